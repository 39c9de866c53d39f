"""`tvist bench --reading` reads the same messages with both readers, and finds equal what it exports."""

import pytest

from tvist_lab.benchmark import reading


@pytest.mark.nightly
async def test_both_readers_read_all_messages(monkeypatch):
    monkeypatch.setattr(reading, "ROUNDS", 1)
    monkeypatch.setattr(reading, "SIMULATED", 200)
    result = await reading.reading(0.02, tell=lambda _: None)
    assert result["messages"] == 2 * 600
    assert result["columns_bytes"] > 600 * 100 * 8
    assert result["ratio"] == result["columns_s"] / result["bare_s"]
    for kind in ("csv", "parquet", "npz", "mat"):
        assert result[kind]["equal"] == 1.0

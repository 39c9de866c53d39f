"""`tvist shapers`: the catalogue as a person and a machine read it."""

import numpy as np
import pytest

from tvist_shaping import SHAPERS, residual
from tvist_shaping.impulses import Impulses

from .test_command_line import tvist


def test_it_lists_every_shaper_as_it_is(tmp_path):
    ended = tvist("shapers", "--json", "--f-d", 6.7, "--zeta", 0.34, "--figures", tmp_path).assert_done()
    assert (ended.json["f_d_hz"], ended.json["zeta"]) == (6.7, 0.34)
    listed = {entry["name"]: entry for entry in ended.json["shapers"]}
    assert list(listed) == list(SHAPERS)
    for name, entry in listed.items():
        assert entry["zeta_max"] == SHAPERS[name].zeta_max
        if SHAPERS[name].zeta_max <= 0.34:
            assert "beyond it take" in entry["not_for_this_mode"]
            continue
        impulses = Impulses(np.array(entry["amplitudes"]), np.array(entry["times_s"]))
        assert entry["duration_ms"] == pytest.approx(1000 * impulses.duration)
        assert entry["mean_delay_ms"] == pytest.approx(1000 * impulses.mean_delay)
        for percent in (5, 10):
            band = entry[f"band_{percent}_percent"]
            for ratio in [] if band is None else band:
                if ratio is not None:
                    assert residual(6.7 * ratio, 0.34, impulses) == pytest.approx(percent / 100, rel=1e-3)
    assert (tmp_path / "shapers.png").stat().st_size > 20_000


def test_people_get_a_table_with_a_line_on_each():
    said = tvist("shapers").assert_done().out
    for name, shaper in SHAPERS.items():
        assert f"{name} " in said
        assert shaper.description in said

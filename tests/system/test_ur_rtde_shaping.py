"""The example whose figure is in docs/how-to/connect-ur-clients.md."""

import re
from pathlib import Path

import pytest
from tests.conformance.served import finished

EXAMPLE = Path(__file__).parents[2] / "clients" / "examples" / "03_ur_rtde_shaping.py"

pytestmark = [pytest.mark.realtime, pytest.mark.nightly]


def test_tool_vibrates_for_a_shorter_time_with_a_shaper(tmp_path):
    pytest.importorskip("rtde_control")
    figure = tmp_path / "figure.png"
    ended = finished(EXAMPLE, figure)
    assert ended.returncode == 0, ended.stderr
    unshaped, shaped = (int(until) for until in re.findall(r"until (-?\d+) ms", ended.stdout))
    assert shaped < unshaped - 40
    assert figure.stat().st_size > 0

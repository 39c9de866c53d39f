"""The example whose figure stands in docs/how-to/connect-ur-clients.md does what the page says."""

import re
from pathlib import Path

import pytest
from tests.conformance.served import finished

EXAMPLE = Path(__file__).parents[2] / "clients" / "examples" / "03_ur_rtde_shaping.py"

pytestmark = [pytest.mark.realtime, pytest.mark.nightly]


def test_the_same_ur_rtde_program_lets_the_tool_shake_for_a_shorter_time_with_a_shaper(tmp_path):
    pytest.importorskip("rtde_control")
    figure = tmp_path / "figure.png"
    ended = finished(EXAMPLE, figure)
    assert ended.returncode == 0, ended.stderr
    unshaped, shaped = (int(until) for until in re.findall(r"until (-?\d+) ms", ended.stdout))
    assert shaped < unshaped - 40
    assert figure.stat().st_size > 0

"""Modes of the control line: what the table says, and that a line keeps to it."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.controller.robots import PAPER, Q1, Q3, H, without_arm

from tvist_controller.line.line_mode import LineMode, check_change
from tvist_controller.trajectory import JointStop

PICTURE = Path(__file__).parents[2] / "docs/images/line-modes.svg"
NAMES = {mode.name for mode in LineMode}


@pytest.mark.parametrize("mode", LineMode, ids=lambda mode: mode.name)
def test_a_row_names_modes_of_the_table_and_ends_in_rest(mode):
    assert set(mode.followed_by) <= NAMES
    assert "REST" in mode.followed_by
    assert mode.at_rest == (mode.name == "REST")


def test_every_mode_can_be_reached_from_rest():
    reached, new = set(), {"REST"}
    while new:
        reached |= new
        new = {after for name in new for after in LineMode[name].followed_by} - reached
    assert reached == NAMES


def test_a_stop_is_final_and_what_bypasses_the_filter_is_not_shaped_before_it_rests():
    assert set(LineMode.STOPPING.followed_by) == {"REST", "STOPPING"}
    for mode in LineMode:
        if not mode.shaped:
            assert not any(LineMode[after].shaped for after in mode.followed_by if after != "REST")


def test_the_page_on_architecture_draws_the_table():
    drawn = " ".join(re.findall(r'data-ways="([^"]+)"', PICTURE.read_text("utf-8"))).split()
    ways = {f"{mode.name}-{after}" for mode in LineMode for after in mode.followed_by if after != mode.name}
    assert sorted(drawn) == sorted(ways)


def test_what_the_table_does_not_have_is_refused_and_changes_nothing():
    line = without_arm()
    move = line.begin(line.plan(Q3, PAPER))
    line.step()
    for _ in range(100):
        line.step()
    stop = line.begin(JointStop(*_state(line), acceleration=4.0, jerk=100.0, period=H), LineMode.STOPPING)
    with pytest.raises(ValueError, match="cannot change from STOPPING to SHAPED"):
        line.begin(move)
    assert line.trajectory is stop
    assert line.mode is LineMode.STOPPING


def test_a_guarded_motion_needs_a_guard():
    line = without_arm()
    with pytest.raises(ValueError, match="needs a guard"):
        line.begin(line.plan(Q3, PAPER), LineMode.GUARDED)
    assert line.at_rest
    assert (line.step().reference == Q1).all()


def test_every_pair_of_modes_is_judged_by_the_table():
    for before in LineMode:
        for after in LineMode:
            if after.name in before.followed_by:
                check_change(before, after, guarded=True)
            else:
                with pytest.raises(ValueError, match=f"from {before.name} to {after.name}"):
                    check_change(before, after, guarded=True)


def _state(line):
    newest = line.newest
    return np.array(newest.q), np.array(newest.qd), np.array(newest.qdd)

"""What the assertions measure, against formulas and against the laboratory's metrics."""

import math
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from tests.examples import examples

from tvist_lab.metrics import motions, peak_after_stop
from tvist_lab.recordings.messages import recording_of_messages
from tvist_protocol import decode
from tvist_protocol.generate import FOLDER as PROTOCOL
from tvist_protocol.modes import RuntimeState
from tvist_protocol.stream import State, Truth
from tvist_testing import assert_residual_vibration_below, assert_settles_within, assert_within_limits
from tvist_testing.assertions import settling, vibration
from tvist_testing.history import History

TARGET = [0.5, -3.1, 0.2, -1.6, 0.0, 0.0]
PERIOD = 0.002


def decaying(amplitude, rate, seconds):
    """Rows of a tool that approaches its position exponentially."""
    times = PERIOD * np.arange(round(seconds / PERIOD) + 1)
    return [
        SimpleNamespace(time=7.0 + t, pose=[0.3 + amplitude * math.exp(-rate * t), 0.1, 0.2, 0.0, 0.0, 0.0])
        for t in times
    ]


def test_settling_time_of_an_exponential():
    seconds, farthest = settling(decaying(1e-3, 30.0, 1.0), 1e-4)
    assert seconds == pytest.approx(math.log(10.0) / 30.0, abs=PERIOD)
    assert farthest == pytest.approx(1e-3, rel=1e-3)


def test_tool_outside_the_band_at_the_end_has_not_settled():
    rows = decaying(1e-3, 30.0, 1.0)
    rows[-1].pose[2] += 1e-3
    assert settling(rows, 1e-4)[0] == math.inf


@examples(20)
@given(st.lists(st.integers(-4, 4), min_size=30, max_size=30), st.sets(st.integers(1, 30)))
def test_state_and_truth_are_matched_by_tick_in_any_order(delays, lost):
    state = decode(State, (PROTOCOL / "fixtures" / "v1" / "state.msgpack").read_bytes())
    truth = decode(Truth, (PROTOCOL / "fixtures" / "v1" / "truth.msgpack").read_bytes())
    ticks = range(1, 31)
    states = [(float(tick), replace(state, tick=tick, runtime_state=RuntimeState.STOPPED)) for tick in ticks]
    truths = [
        (tick + 0.5 + delay, replace(truth, tick=tick, flange_pose=[float(tick)] * 6))
        for tick, delay in zip(ticks, delays, strict=True)
        if tick not in lost
    ]
    history = History()
    for _, message in sorted(states + truths, key=lambda pair: pair[0]):
        (history.on_state if isinstance(message, type(state)) else history.on_truth)(message)
    rows = history.since_rest()
    if len(lost) < len(ticks):
        assert [row.tick for row in rows] == [tick for tick in ticks if tick not in lost]
        assert all(row.pose[0] == row.tick for row in rows)
    else:
        assert len(rows) == len(ticks)


@pytest.mark.parametrize("rotation", [(0.3, -1.2, 2.0), (math.pi, 0.0, 0.0)])
def test_tool_at_rest_has_no_vibration_in_any_orientation(rotation):
    from scipy.spatial.transform import Rotation

    force = Rotation.from_rotvec(rotation).inv().apply([0.0, 0.0, 9.81])
    rows = [SimpleNamespace(time=t, pose=[0.0, 0.0, 0.0, *rotation], acceleration=force) for t in (0.0, 0.1)]
    assert vibration(rows, 0.3) == [(0.1, pytest.approx(0.0, abs=1e-12))]


@pytest.mark.tvist_shaper("none")
def test_residual_vibration_matches_the_laboratory(tvist_robot):
    states, truths = [], []
    tvist_robot.on_state(states.append)
    tvist_robot.on_truth(truths.append)
    with tvist_robot.control("me") as arm:
        arm.move_j(TARGET)
    value = assert_residual_vibration_below(tvist_robot, 2.0)
    recording = recording_of_messages(states, truths=truths)
    (motion,) = motions(recording)
    assert value == pytest.approx(peak_after_stop(recording, motion), rel=1e-9)
    with pytest.raises(AssertionError, match=r"residual vibration of ur5e is .* above 0.1 m/s²\n.*largest"):
        assert_residual_vibration_below(tvist_robot, 0.1)
    took = assert_settles_within(tvist_robot, 1.0)
    with pytest.raises(AssertionError, match="does not settle within"):
        assert_settles_within(tvist_robot, took - PERIOD)


def test_limits_are_the_robots_own_unless_given(tvist_robot):
    with pytest.raises(AssertionError, match="no time has passed"):
        assert_within_limits(tvist_robot)
    for check in (assert_settles_within, assert_residual_vibration_below):
        with pytest.raises(AssertionError, match="ur5e has not moved"):
            check(tvist_robot, 1.0)
    with tvist_robot.control("me") as arm:
        arm.move_j(TARGET)
    assert_within_limits(tvist_robot)
    with pytest.raises(AssertionError) as failed:
        assert_within_limits(tvist_robot, speed=0.2, tool_speed=0.25)
    assert "joint 0: speed [rad/s]" in str(failed.value)
    assert "tool: speed [m/s]" in str(failed.value)
    assert "joint 1" not in str(failed.value)
    fast = max(abs(row.qd[0]) for row in tvist_robot.history.rows)
    assert_within_limits(tvist_robot, speed=[fast, *[0.5] * 5])


def test_invalid_limits_are_refused():
    checks = assert_settles_within, assert_residual_vibration_below
    for check, wrong in product(checks, (-1.0, math.nan, "fast", True)):
        with pytest.raises(ValueError, match="must be a number"):
            check(SimpleNamespace(), wrong)

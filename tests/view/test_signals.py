"""Signals for plots equal those of the laboratory, for messages in any order."""

import numpy as np
import pinocchio as pin
import pytest

from tvist_controller.about import geometry_of
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_plant.description import load
from tvist_plant.model import FLANGE, rigid_model
from tvist_protocol.stream import Truth
from tvist_view.look import Look
from tvist_view.signals import LATE_TICKS, LatestSignals, rests_since, signals_of, up_in_flange

UR5E = load("ur5e")
LOOK = Look(geometry_of(UR5E), UR5E.payload)


def signals(moved, *, truth=True):
    return signals_of(LOOK, moved.states, {one.tick: one for one in moved.truths} if truth else {})


@pytest.mark.parametrize("truth", [True, False])
def test_tool_acceleration_matches_the_laboratory(moved, truth):
    expected = amplitude(tool_acceleration(moved.recording(), truth=truth))
    np.testing.assert_allclose(signals(moved, truth=truth).alpha, expected, atol=1e-9)


@pytest.mark.parametrize("name", ["ur5e", "tests/plant/urdf/seven.urdf"])
def test_upward_direction_matches_pinocchio(name):
    description = load(name)
    look = Look(geometry_of(description), description.payload)
    rigid = rigid_model(description, description.payload)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (20, description.joints))
    data = rigid.createData()
    for angles, up in zip(q, up_in_flange(q, look.turns), strict=True):
        pin.framesForwardKinematics(rigid, data, angles)
        np.testing.assert_allclose(up, data.oMf[rigid.getFrameId(FLANGE)].rotation[2], atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_state_and_truth_are_matched_by_tick_in_any_order(moved, seed):
    random = np.random.default_rng(seed)
    count = 200
    times = np.arange(count) + random.integers(-4, 5, count) + 0.5
    lost = set(random.integers(0, count - LATE_TICKS - 10, seed).tolist())
    states = [(float(place), state) for place, state in enumerate(moved.states[:count])]
    truths = [(times[i], truth) for i, truth in enumerate(moved.truths[:count]) if i not in lost]
    running = LatestSignals(LOOK)
    assert running.row() is None
    for _, message in sorted(states + truths, key=lambda pair: pair[0]):
        running.add(message)
        if isinstance(message, Truth) and random.random() < 0.3:
            running.update()
    running.update()
    drawn = running.row()
    last = moved.truths[count - 1]
    assert drawn[:6] == last.motor_q
    found = running.signals()
    assert (np.diff(found.time) > 0.0).all()
    expected = amplitude(tool_acceleration(moved.recording(), truth=True))[:count]
    expected[list(lost)] = np.nan
    np.testing.assert_allclose(found.alpha, expected[1:-1], atol=1e-9)
    whole = signals(moved).unshaped[1 : count - 1]
    np.testing.assert_allclose(found.unshaped, whole, atol=1e-9)
    running.add(moved.states[0])  # it has started anew
    assert len(running.signals().time) == 0


def test_each_sample_is_sent_once(moved):
    running, told = LatestSignals(LOOK), []
    count = 0
    for number, state in enumerate(moved.states):
        running.add(state)
        if number % 17 == 0:
            running.update()
            told += running.since(count)[0]
            count = running.count
    assert told == [round(state.timestamp, 4) for state in moved.states[1 : len(told) + 1]]
    running.add(moved.states[-1])  # told again
    running.update()
    assert running.count == len(moved.states) - 2


def test_shaped_reference_comes_to_rest_after_the_unshaped_one(moved):
    found = signals(moved)
    rests = rests_since(found)
    assert rests is not None
    reference, shaped = rests
    assert 0.02 < shaped - reference < 0.2
    assert rests_since(found.between(0.0, reference - 0.1)) is None


def test_unshaped_acceleration_is_right_and_zero_at_gaps(moved):
    found = signals(moved)
    assert 1.9 < found.unshaped.max() < 2.0 + 1e-6
    sparse = signals_of(LOOK, moved.states[::7] + moved.states[-3:], {})
    assert sparse.unshaped.max() < 2.1


def test_there_are_no_signals_before_the_first_state():
    found = LatestSignals(LOOK).signals()
    assert len(found.time) == len(found.alpha) == 0
    assert rests_since(found) is None

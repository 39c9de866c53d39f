"""Signals for plots: against the laboratory's own figures, and whatever the order of messages."""

import asyncio

import numpy as np
import pytest
from msgspec.structs import replace

from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.metrics.vibration import amplitude, tool_acceleration
from tvist_plant.description import load
from tvist_view.moments import Moments
from tvist_view.scene import Moment
from tvist_view.signals import History, rests_since

TWISTS = load("ur5e").kinematics.alpha


@pytest.fixture(scope="module")
def collected():
    """Two motions, shaped, with their truth."""

    async def move():
        async with robot_in_process(free_setup(shaper="zv")) as robot:
            with collect(robot) as collected:
                async with robot.control("test") as arm:
                    await arm.move_j([0.7, -2.5, 0.5, -1.2, 0.3, 0.2])
                    await robot.advance(500)
            return collected

    return asyncio.run(move())


def history(collected, samples=5000, *, truth=True):
    kept = History(TWISTS, samples)
    for state, true in zip(collected.states, collected.truths, strict=True):
        if truth:
            kept.add_truth(true)
        kept.add(state)
    return kept


@pytest.mark.parametrize("truth", [True, False])
def test_alpha_is_the_laboratorys(collected, truth):
    expected = amplitude(tool_acceleration(collected.recording(), truth=truth))
    np.testing.assert_allclose(history(collected, truth=truth).signals().alpha, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_what_is_drawn_and_plotted_is_of_one_tick_in_whatever_order_state_and_truth_come(collected, seed):
    random = np.random.default_rng(seed)
    times = np.maximum.accumulate(np.arange(30) + random.integers(-4, 5, 30)) + 0.5
    lost = set(random.integers(0, 30, seed).tolist())
    states = [(float(place), state) for place, state in enumerate(collected.states[:30])]
    truths = [(times[i], truth) for i, truth in enumerate(collected.truths[:30]) if i not in lost]
    moments, kept = Moments(), History(TWISTS, 100)
    assert moments.newest() is None
    for _, message in sorted(states + truths, key=lambda pair: pair[0]):
        moments.add(message)
        drawn = moments.newest()
        assert drawn is None or drawn.truth is None or drawn.truth.tick == drawn.state.tick
    for _, state in states:
        kept.add(state)
    for _, truth in truths:
        kept.add_truth(truth)
    assert drawn.state.tick == max(truth.tick for _, truth in truths)
    expected = amplitude(tool_acceleration(collected.recording(), truth=True))[:30]
    expected[list(lost)] = np.nan
    np.testing.assert_allclose(kept.signals().alpha, expected, atol=1e-9)
    moments.add(collected.states[0])  # it has started anew
    assert moments.newest() == Moment(collected.states[0], None)


def test_a_full_ring_keeps_the_newest_in_order(collected):
    whole, part = history(collected).signals(), history(collected, 700).signals()
    assert len(part.time) == 700
    assert (np.diff(part.time) > 0.0).all()
    np.testing.assert_array_equal(part.alpha, whole.alpha[-700:])


def test_what_is_told_again_counts_once_and_a_robot_that_starts_anew_begins_anew(collected):
    kept = history(collected)
    count = len(kept.signals().time)
    kept.add(collected.states[-1])
    assert len(kept.signals().time) == count
    kept.add(replace(collected.states[-1], timestamp=0.002))
    assert len(kept.signals().time) == 1


def test_the_shaped_reference_comes_to_rest_after_the_unshaped_one(collected):
    signals = history(collected).signals()
    rests = rests_since(signals)
    assert rests is not None
    reference, shaped = rests
    assert 0.02 < shaped - reference < 0.2
    assert rests_since(signals.between(0.0, reference - 0.1)) is None


def test_the_acceleration_before_the_shaper_keeps_the_limit_and_none_is_made_up_over_a_hole(collected):
    signals = history(collected).signals()
    assert 1.9 < signals.unshaped.max() < 2.0 + 1e-6
    sparse = History(TWISTS, 5000)
    for state in collected.states[::7] + collected.states[-3:]:
        sparse.add(state)
    assert sparse.signals().unshaped.max() < 2.1


def test_nothing_is_there_before_the_first_state():
    signals = History(TWISTS, 100).signals()
    assert len(signals.time) == len(signals.alpha) == 0
    assert rests_since(signals) is None

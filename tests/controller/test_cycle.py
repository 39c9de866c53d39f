"""The control line as a whole: Figure 6."""

import numpy as np
import pytest

from tvist_controller.line.differentiator import STILL
from tvist_controller.line.line_mode import LineMode
from tvist_shaping.estimators.fixed import Fixed

from .robots import FITTING, PAPER, Q1, Q2, Q3, H, cycle, without_arm

GRAVITY = np.array([0.0, 0.0, -9.81])


def motion(line, target, limits=PAPER):
    """Shaped reference at every tick of a motion, and for a while after; ticks until it was said to rest."""
    line.begin(line.plan(np.array(target), limits))
    shaped, rested = [], None
    for tick in range(6000):
        line.step()
        shaped.append(line.position)
        if rested is None and line.at_rest:
            rested = tick
        if rested is not None and tick > rested + 600:
            return np.array(shaped), rested
    raise AssertionError("still moving")


def alpha(line):
    """Magnitude of the flange's acceleration without gravity, free of noise [m/s^2]."""
    truth = line.plant.truth()
    return np.linalg.norm(truth.flange_rotation @ truth.specific_force + GRAVITY)


def residual(name):
    """Largest acceleration from 10 ms to 0.3 s after the shaped reference rests."""
    line = cycle(name, estimator=Fixed([6.7], [0.34]))
    line.begin(line.plan(Q2, PAPER))
    while not line.at_rest:
        line.step()
    after = []
    for _ in range(150):
        line.step()
        after.append(alpha(line))
    return max(after[5:])


def test_shaping_takes_most_of_the_residual_vibration():
    unshaped = residual("none")
    assert 0.5 < unshaped < 2.5
    assert residual("zv") < 0.3 * unshaped


@pytest.mark.parametrize("name", FITTING)
@pytest.mark.parametrize("target", [Q2, Q3, Q1 + 0.3, Q1 + 1e-3])
def test_at_rest_is_one_tick_after_the_last_that_moved(name, target):
    """A target is the shaped reference of a tick before, so that tick is two after the last that moved.

    Up to two more where a small last impulse makes steps below 1e-7 rad that come to more than that together.
    """
    shaped, rested = motion(without_arm(name), target)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    last_moved = np.flatnonzero(steps > STILL)[-1] + 1
    assert last_moved + 2 <= rested <= last_moved + (2 if name in {"none", "zv"} else 4)
    assert (shaped[-1] == target).all()


@pytest.mark.parametrize("name", ["zv", "zvd", "ei3"])
def test_a_plateau_between_two_impulses_is_no_rest(name):
    """A jog of 0.1 mrad lasts 32 ms, the shaper 75 ms and more: in between the shaped reference stands still."""
    line = without_arm(name, estimator=Fixed([6.7], [0.1]))
    shaped, rested = motion(line, Q1 + 1e-4)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    assert (steps[: rested - 2] < STILL).sum() > 15
    assert rested * H > line.tvist.delay
    assert np.abs(shaped[rested:] - Q1 - 1e-4).max() <= STILL
    assert (shaped[rested + 20 :] == Q1 + 1e-4).all()


def test_moves_one_after_the_other_begin_where_the_reference_ended():
    """Not where the shaped reference was when it was said to rest, up to 1e-7 rad before."""
    line = without_arm()
    for target in (Q1 + 0.2, Q1 + 0.5):
        line.begin(line.plan(target, PAPER))
        line.step()
        while not line.at_rest:
            line.step()
        assert (line.reference == target).all()
    fresh = without_arm(q=Q1 + 0.5)
    assert (motion(line, Q2)[0][:900] == motion(fresh, Q2)[0][:900]).mean() > 0.99


def test_shaping_lasts_as_long_as_its_delay_says():
    """Double-S plus delay at the end, on the tick grid."""
    line = without_arm("zv", estimator=Fixed([6.7], [0.34]))
    _, plain = motion(without_arm("none"), Q2)
    _, shaped = motion(line, Q2)
    assert (shaped - plain) * H == pytest.approx(0.5 / 6.7, abs=3 * H)


def test_the_target_s_derivatives_are_central_differences_of_the_shaped_reference():
    line = without_arm()
    line.begin(line.plan(Q3, PAPER))
    samples = [line.step().target for _ in range(700)]
    q = np.array([target.q for target in samples])
    qd, qdd = np.array([target.qd for target in samples]), np.array([target.qdd for target in samples])
    assert qd[1:-1] == pytest.approx((q[2:] - q[:-2]) / (2 * H), abs=1e-11)
    assert qdd[1:-1] == pytest.approx(np.diff(q, 2, axis=0) / H**2, abs=1e-8)


def test_what_a_stream_leaves_behind_comes_to_rest_through_the_filter():
    line = without_arm("zv")
    stream = line.stream(H, PAPER)
    for k in range(300):
        stream.offer(k, Q1 + 0.2 * (1 - np.cos(2.0 * k * H)))
        line.step()
    line.begin(stream.end)
    shaped = []
    while not line.at_rest:
        line.step()
        shaped.append(line.position)
    assert line.mode is not LineMode.STOPPING
    assert np.abs(np.diff(shaped, 2, axis=0)).max() / H**2 < 1.2 * PAPER.acceleration
    assert shaped[-1] == pytest.approx(line.reference, abs=STILL)
    assert len(shaped) * H > line.tvist.delay

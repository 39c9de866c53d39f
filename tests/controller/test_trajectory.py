"""Point-to-point motions."""

from math import ceil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, Rest, quickest_motion

from .robots import PAPER, Q1, Q2, Q3, H

MOTIONS = [(Q1, Q2, 1.8172), (Q1, Q3, 2.5153), (Q3, Q1, 2.5153)]
angles = st.floats(-6.28, 6.28)


def played(motion: PlannedMotion, start) -> np.ndarray:
    """All references, the start first and the target for some ticks at the end."""
    points = [start]
    while not motion.finished:
        points.append(motion.next())
    return np.array(points + [motion.next() for _ in range(3)])


@pytest.mark.parametrize(("start", "target", "duration"), MOTIONS)
def test_duration_follows_the_textbook(start, target, duration):
    """Biagiotti and Melchiorri 2008, sec. 3.4, with the velocity limit reached."""
    way = np.abs(target - start).max()
    v, a, j = PAPER.velocity, PAPER.acceleration, PAPER.jerk
    assert quickest_motion(JointLine(start, target), PAPER, H).duration == pytest.approx(
        way / v + v / a + a / j, rel=1e-12
    )


@pytest.mark.parametrize(("start", "target", "duration"), MOTIONS)
def test_on_the_tick_grid_the_target_is_reached_at_the_first_tick_after_the_end(start, target, duration):
    points = played(quickest_motion(JointLine(start, target), PAPER, H), start)
    arrived = np.flatnonzero((points == target).all(axis=1))[0]
    assert arrived == ceil(duration / H)
    assert (points[arrived:] == target).all()


@pytest.mark.parametrize(("start", "target"), [(Q1, Q3), (np.zeros(6), np.array([1, -2, 3, 0, 1e-3, -0.5]))])
def test_joints_are_in_phase(start, target):
    points = played(quickest_motion(JointLine(start, target), PAPER, H), start)
    share = (points - start) @ (target - start) / np.sum((target - start) ** 2)
    assert np.abs(points - (start + share[:, None] * (target - start))).max() < 1e-12
    assert (np.diff(share) > -1e-13).all()


@examples(60)
@given(
    ends=st.integers(1, 7).flatmap(lambda n: st.lists(st.tuples(angles, angles), min_size=n, max_size=n)),
    velocity=st.floats(0.05, 3.14),
    acceleration=st.floats(0.5, 40.0),
    jerk=st.floats(10.0, 2000.0),
)
def test_limits_hold_by_differences_and_the_end_is_exact(ends, velocity, acceleration, jerk):
    """Differences over a tick are means over it, and so within the limits; the last tick is cut at the target.

    Rounding of ε = 2e-16 in 2π is worth 2ε·2π/h in velocity, 4ε·2π/h² in acceleration, 8ε·2π/h³ in jerk; that
    of ruckig's own polynomials is some ten times more.
    """
    start, target = np.array(ends).T
    motion = quickest_motion(JointLine(start, target), MotionLimits(velocity, acceleration, jerk), H)
    assert motion.duration < 300.0
    points = played(motion, start)
    assert (points[-1] == target).all()
    assert np.isfinite(points).all()
    assert np.abs(np.diff(points, axis=0) / H).max(initial=0) <= velocity * (1 + 1e-9) + 1e-10
    assert np.abs(np.diff(points, 2, axis=0) / H**2).max(initial=0) <= acceleration * (1 + 1e-9) + 1e-7
    assert np.abs(np.diff(points, 3, axis=0) / H**3).max(initial=0) <= jerk * (1 + 1e-6) + 1e-4


def test_a_way_of_zero_length_is_over_at_once():
    motion = quickest_motion(JointLine(Q1, Q1), PAPER, H)
    assert motion.finished
    assert motion.duration == 0.0
    assert (motion.next() == Q1).all()


def test_a_motion_of_hours_is_an_error_with_the_limits_in_it():
    with pytest.raises(ValueError, match="velocity 1e-05, acceleration 2, jerk 100"):
        quickest_motion(JointLine(Q1, Q2), MotionLimits(1e-5, 2.0, 100.0), H)


def test_rest_stays():
    rest = Rest(Q2)
    assert rest.finished
    assert all((rest.next() == Q2).all() for _ in range(10))

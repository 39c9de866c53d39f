"""Point-to-point motions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_protocol import commands as c
from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Accepted, Done

from .robots import PAPER, Q1, Q3, H, Robot

angles = st.floats(-6.28, 6.28)


def played(motion: PlannedMotion, start) -> np.ndarray:
    """All references, the start first and the target for some ticks at the end."""
    points = [start]
    while not motion.finished:
        points.append(motion.next())
    return np.array(points + [motion.next() for _ in range(3)])


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


TOLERANCE = 1.002
"""The double S itself has its acceleration as a difference over two ticks."""


def with_speeds(speeds, limits=PAPER, most=20_000):
    """A motion from Q1 to Q3 with the speed given at each tick; positions, and rates after each tick."""
    motion = quickest_motion(JointLine(Q1, Q3), limits, H)
    q, rates = [Q1, Q1], []
    for tick in range(most):
        motion.speed = speeds(tick)
        q.append(motion.next())
        rates.append(motion.rate)
        if motion.finished:
            break
    q += [q[-1]] * 3
    return np.array(q), np.array(rates)


def accelerations(q):
    return np.abs(np.diff(q, 2, axis=0)).max() / H**2


@pytest.mark.parametrize("seed", range(12))
def test_whatever_the_slider_does_acceleration_and_velocity_stay_inside_the_limits(seed):
    random = np.random.default_rng(seed)
    speeds = np.repeat(random.choice([0.0, 0.1, 0.5, 0.8, 1.0], 400), random.integers(5, 200, 400))
    q, _ = with_speeds(lambda tick: float(speeds[tick]) if tick < len(speeds) else 1.0)
    assert accelerations(q) <= PAPER.acceleration * TOLERANCE
    assert np.abs(np.diff(q, axis=0)).max() / H <= PAPER.velocity * (1.0 + 1e-9)
    assert np.array_equal(q[-1], Q3)


def test_half_speed_from_the_start_takes_twice_as_long_on_the_same_way():
    robot = Robot()
    assert robot.send(c.SetSpeed, fraction=0.5) == Done()
    robot.send(c.SetShaper, name="none")
    assert robot.send(c.MoveJ, q=tuple(Q3)) == Accepted(id=1)
    robot.until_rest()
    started, done = (
        next(e.tick for e in robot.events if e.kind == kind) for kind in ("motion_started", "motion_done")
    )
    assert (done - started) * H == pytest.approx(2.0 * 2.5153, abs=0.01)
    way = (robot.column("reference_q") - Q1) @ (Q3 - Q1) / np.sum((Q3 - Q1) ** 2)
    off = robot.column("reference_q") - Q1 - way[:, None] * (Q3 - Q1)
    assert np.abs(off).max() < 1e-9
    assert {state.speed_scaling for state in robot.states} == {0.5}


def test_a_pause_brings_the_arm_to_rest_on_its_way_and_resume_takes_it_to_the_target():
    robot = Robot()
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.tick(500)
    assert robot.send(c.Pause) == Done()
    assert robot.tick().runtime_state == RuntimeState.PAUSING
    robot.tick(1500)
    paused = robot.states[-1]
    assert paused.runtime_state == RuntimeState.PAUSED
    assert paused.speed_scaling == 0.0
    assert np.abs(robot.column("target_q")[-100:] - paused.target_q).max() < 1e-9
    assert "motion_done" not in robot.kinds()
    assert robot.send(c.MoveJ, q=tuple(Q1)).code == "busy"
    assert robot.send(c.Resume) == Done()
    robot.until_rest()
    assert robot.kinds() == ["motion_started", "motion_done"]
    assert np.allclose(robot.states[-1].target_q, Q3, atol=1e-7)
    assert np.abs(robot.column("target_qdd")).max() <= 2.1

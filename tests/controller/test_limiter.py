"""The limiter keeps limits, and is exact again afterwards."""

from itertools import chain, repeat

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_controller.trajectory.limiter import Limiter
from tvist_protocol import commands as c
from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Accepted, Done

from .robots import PAPER, Q1, Q3, H
from .streams import assert_within


def at_rest(q, limits, reach=np.inf, torque=None):
    still = np.zeros_like(q)
    return Limiter((q, still, still), limits, np.broadcast_to(reach, q.shape), torque)


def followed(limiter: Limiter, points) -> np.ndarray:
    """Return the output for a walk from rest, with slopes of parabolas through three points."""
    out, before, last = [limiter.q], limiter.q, limiter.q
    for point in points:
        rise, fall = point - last, last - before
        out.append(limiter.follow(point, (1.5 * rise - 0.5 * fall) / H))
        before, last = last, point
    return np.array(out)


@examples(30)
@given(
    seed=st.integers(0, 2**32 - 1),
    joints=st.integers(1, 7),
    roughness=st.sampled_from([1e-7, 3e-6, 1e-5, 1e-4, 3e-3, 0.1]),
    limits=st.builds(
        MotionLimits,
        velocity=st.floats(0.1, 3.14),
        acceleration=st.floats(0.5, 40.0),
        jerk=st.floats(10.0, 2000.0),
    ),
)
def test_the_limiter_keeps_limits_and_catches_up_with_random_walks(seed, joints, roughness, limits):
    random = np.random.default_rng(seed)
    walk = np.cumsum(np.cumsum(random.normal(0, roughness, (150, joints)), axis=0) / 10, axis=0)
    walk = np.clip(walk, -2.0, 2.0)
    limiter = at_rest(np.zeros(joints), limits)
    out = followed(limiter, walk)
    way = np.abs(out[-1] - walk[-1]).max()
    ramps = limits.velocity / limits.acceleration + 4 * limits.acceleration / limits.jerk
    enough = int((way / limits.velocity + 8 * ramps + 1.0) / H)
    still = np.zeros(joints)
    # Then its third difference, too, has seen the stop.
    held = [limiter.follow(walk[-1], still) for _ in range(3)]
    while limiter.limited and len(held) < enough:
        held.append(limiter.follow(walk[-1], still))
    held += [limiter.follow(walk[-1], still) for _ in range(10)]
    assert_within(np.array([*out, *held]), limits, beyond=(2e-6, 1e-5))
    assert (np.array(held[-10:]) == walk[-1]).all()


@pytest.mark.parametrize("jump", [1e-4, 0.01, 0.2, -0.2])
@pytest.mark.parametrize(
    "motion",
    [
        lambda t: 0.5 * (t - 0.25 * np.tanh(t / 0.25)),  # comes to 0.5 rad/s
        lambda t: 0.05 * (1 - np.cos(2.5 * t)) ** 2,
    ],
)
def test_the_limiter_passes_a_moving_signal_unchanged_after_catching_up(motion, jump):
    """It approaches no faster than the signal could still brake, so that it does not overshoot."""
    time = np.arange(2500) * H
    walk = np.stack([motion(time) + jump * (time > 1.0), 0.1 * motion(time)], axis=1)
    limiter = at_rest(walk[0], PAPER)
    out = followed(limiter, walk[1:])
    assert_within(out, beyond=(2e-6, 1e-5))
    equal = out == walk
    began = int(1.0 / H) + 1
    caught_up = began + int(
        (0.5 + 6 * np.sqrt(abs(jump) / PAPER.acceleration) + 8 * 0.5 / PAPER.acceleration) / H
    )
    assert equal[:began].all()
    assert not equal[began + 1, 0]
    assert equal[caught_up:].all()
    assert equal[:, 1].all(), "the other joint is not held back"


class Narrow:
    """Torque that permits an acceleration, by number of queried states."""

    def __init__(self, limit):
        self.limit, self.asked = limit, 0

    def allows(self, _q, _qd, qdd):
        self.asked += 1
        return np.abs(qdd).max() <= self.limit(self.asked)

    def acceleration(self, _q, _qd):
        return self.limit(self.asked)


@examples(8)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_falling_torque_limit_is_kept_within_the_jerk_limit(seed):
    """Acceleration decreases at the jerk limit; until then it exceeds the limit by its fall."""
    random = np.random.default_rng(seed)
    swing = random.uniform(0.02, 0.1, 3)
    time = np.arange(1000) * H
    walk = swing * (1 - np.cos(random.uniform(2, 6) * time))[:, None] ** 2
    torque = Narrow(lambda asked: 1.0 + 0.7 * (1 + np.cos(0.01 * asked)))
    limiter = at_rest(np.zeros(3), PAPER, torque=torque)
    excess, before = 0.0, (limiter.q, limiter.q)
    for point, last in zip(walk[1:], walk, strict=False):
        q = limiter.follow(point, (point - last) / H)
        qdd = np.abs(q - 2 * before[1] + before[0]).max() / H**2
        excess = max(excess, qdd - torque.acceleration(None, None))
        before = before[1], q
    assert excess <= 0.05


@pytest.mark.parametrize("speed", [0.3, 1.0, 2.5])
def test_a_joint_with_little_torque_stops_inside_its_range(speed):
    """Its stop uses the acceleration that torque permits."""
    reach, weak = 2.0, Narrow(lambda _: 4.0)
    limiter = at_rest(np.zeros(2), MotionLimits(3.0, 40.0, 2000.0), reach=np.full(2, reach), torque=weak)
    ramp = np.minimum(speed * H * np.arange(4000), reach)
    out = followed(limiter, np.column_stack((ramp, -ramp)))
    assert np.abs(out).max() <= reach
    assert np.abs(out[-1]).min() == pytest.approx(reach, abs=1e-3)


angles = st.floats(-6.28, 6.28)


def played(motion: PlannedMotion, start) -> np.ndarray:
    """Return all references: the start first, and the target for some ticks at the end."""
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
def test_planned_motions_keep_limits_by_differences_and_end_exactly(ends, velocity, acceleration, jerk):
    """Differences over a tick are means over it and so within limits; the last tick ends at the target.

    Rounding of ε = 2e-16 in 2π is worth 2ε·2π/h in velocity, 4ε·2π/h² in acceleration, 8ε·2π/h³ in jerk; that
    of ruckig's own polynomials is some ten times more.
    """
    start, target = np.array(ends).T
    motion = quickest_motion(JointLine(start, target), MotionLimits(velocity, acceleration, jerk))
    assert motion.duration < 300.0
    points = played(motion, start)
    assert (points[-1] == target).all()
    assert np.isfinite(points).all()
    assert np.abs(np.diff(points, axis=0) / H).max(initial=0) <= velocity * (1 + 1e-9) + 1e-10
    assert np.abs(np.diff(points, 2, axis=0) / H**2).max(initial=0) <= acceleration * (1 + 1e-9) + 1e-7
    assert np.abs(np.diff(points, 3, axis=0) / H**3).max(initial=0) <= jerk * (1 + 1e-6) + 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_speed_changes_keep_velocity_and_acceleration_limits(seed):
    random = np.random.default_rng(seed)
    speeds = np.repeat(random.choice([0.0, 0.1, 0.5, 0.8, 1.0], 400), random.integers(5, 200, 400))
    motion, q = quickest_motion(JointLine(Q1, Q3), PAPER), [Q1, Q1]
    for speed in chain(speeds.tolist(), repeat(1.0, 10_000)):
        motion.speed = speed
        q.append(motion.next())
        if motion.finished:
            break
    q = np.array([*q, q[-1], q[-1], q[-1]])
    # The double S itself has its acceleration as a difference over two ticks.
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= PAPER.acceleration * 1.002
    assert np.abs(np.diff(q, axis=0)).max() / H <= PAPER.velocity * (1.0 + 1e-9)
    assert np.array_equal(q[-1], Q3)


def test_half_speed_takes_twice_as_long_on_the_same_path(robot):
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


def test_pause_stops_on_the_path_and_resume_continues_to_the_target(robot):
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

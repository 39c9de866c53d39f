"""The speed slider, pause and resume: time on the path goes slower and faster inside the limits."""

import numpy as np
import pytest

from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_protocol import commands as c
from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Accepted, Done

from .robots import PAPER, Q1, Q3, H, Robot

TOLERANCE = 1.002
"""The double S itself has its acceleration as a difference over two ticks."""


def played(speeds, limits=PAPER, most=20_000):
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
    q, _ = played(lambda tick: float(speeds[tick]) if tick < len(speeds) else 1.0)
    assert accelerations(q) <= PAPER.acceleration * TOLERANCE
    assert np.abs(np.diff(q, axis=0)).max() / H <= PAPER.velocity * (1.0 + 1e-9)
    assert np.array_equal(q[-1], Q3)


def test_at_full_speed_the_motion_is_the_one_without_a_slider_to_the_bit():
    touched, rates = played(lambda _: 1.0)
    assert set(rates) == {1.0}
    assert len(touched) - 5 == int(np.ceil(2.5153292519943293 / H))


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


def test_a_stop_ends_a_paused_motion_and_the_next_one_is_not_paused():
    robot = Robot()
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.tick(400)
    robot.send(c.Pause)
    robot.tick(1500)
    robot.send(c.Stop)
    robot.until_rest()
    assert robot.kinds() == ["motion_started", "motion_stopped"]
    assert robot.send(c.MoveJ, q=tuple(Q1)) == Accepted(id=2)
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"


def test_slow_limits_do_not_make_the_pause_impossible():
    q, rates = played(lambda tick: 0.0 if 2000 < tick < 6000 else 1.0, MotionLimits(0.2, 0.05, 1.0))
    assert rates[5900] == 0.0
    assert np.array_equal(q[-1], Q3)
    assert accelerations(q) <= 0.05 * 1.01

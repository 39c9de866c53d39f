"""Planning of stops: as hard as the joints' torque allows."""

import msgspec
import numpy as np
import pytest

from tvist_controller.foresight.stops import STEP, StopPlanner
from tvist_controller.line.differentiator import Target
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import (
    GENTLEST_STOP,
    TORQUE_SHARE,
    StopTorque,
    acceleration_on_way,
)
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_plant.description import Payload
from tvist_protocol import commands as c
from tvist_protocol.simulation import SimulationReset

from .robots import Q1, Q3, UR5E, H, Robot

DISC = UR5E.payload
LIMITS = UR5E.limits


def plan(q, qd, qdd, wanted=None, *, payload=DISC, description=UR5E, clear=lambda _: True):
    """The stop of every joint by itself, as a stream is stopped."""
    state = Target(*(np.array(values, dtype=float) for values in (q, qd, qdd)))
    planner = StopPlanner(description, InverseDynamics(description, payload), H)
    return planner.by_joints(state, wanted, clear)


def torques(stop, payload=DISC):
    """Along the whole stop, the start first, ten times as fine as the plan looks."""
    dynamics = InverseDynamics(UR5E, payload)
    times = np.linspace(0.0, stop.duration, 121)
    return np.array([np.abs(dynamics.torque(*stop.at(time))) for time in times])


def moving(seed):
    random = np.random.default_rng(seed)
    return random.uniform(-3, 3, 6), random.uniform(-1.5, 1.5, 6), random.uniform(-2, 2, 6)


@pytest.mark.parametrize("seed", range(25))
def test_the_torque_stays_within_its_share_unless_the_motion_already_takes_more(seed):
    """Two percent for what lies between the plan's samples."""
    stop = plan(*moving(seed))
    if stop is not None:
        taken = torques(stop)
        most = np.maximum(TORQUE_SHARE * np.array(LIMITS.torque), taken[0])
        assert (taken <= 1.02 * most).all()


@pytest.mark.parametrize("seed", range(25))
def test_of_all_decelerations_that_keep_the_torque_the_hardest_is_taken(seed):
    """Each is asked for itself: what a hard stop does not keep a gentler one may not, either."""
    state = Target(*map(np.array, moving(seed)))
    stop = plan(*state.__reduce__()[1])
    torque = StopTorque(InverseDynamics(UR5E, DISC), state, np.array(LIMITS.torque))
    planner = StopPlanner(UR5E, InverseDynamics(UR5E, DISC), H)
    tried = [min(LIMITS.acceleration) * STEP**k for k in range(16)]
    held = [a for a in tried if torque.holds(planner.stop(state, a))]
    if held:
        assert stop.acceleration == pytest.approx(max(held))
    elif stop is not None:  # none keeps what the flexible arm swings beyond, too
        assert torque.holds(stop, rebound=False) or stop.acceleration == GENTLEST_STOP


def test_a_stop_that_is_not_clear_is_passed_over_for_one_that_is():
    state = Q3, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], np.zeros(6)
    free = plan(*state)
    assert plan(*state, clear=lambda stop: stop.acceleration < 5.0).acceleration < 5.0 < free.acceleration
    assert plan(*state, clear=lambda _: False) is None
    gentle = plan(*state, 1.0, clear=lambda stop: stop.duration < 0.3)
    assert gentle.duration < 0.3
    assert gentle.acceleration < free.acceleration, "hardened until it is clear, and no more"


@pytest.mark.parametrize("seed", range(12))
def test_a_stop_is_no_protective_stop(seed):
    """The flexible arm swings beyond what is asked of it, but never for more than 10 ms beyond its drives' limits."""
    random = np.random.default_rng(seed)
    robot = Robot(seed=seed)
    if seed % 2:
        robot.send(SimulationReset, q=tuple(Q3))
    start = np.array(robot.tick().target_q)
    robot.send(c.ServoStart)
    swing, pace = random.uniform(-0.3, 0.3, 6), random.uniform(1.5, 3.0)
    for k in range(int(random.integers(200, 600))):
        robot.setpoint(k, start + swing * (1.0 - np.cos(pace * k * H)))
        robot.tick()
    robot.send(c.Stop)
    robot.tick(300)
    assert "protective_stop" not in robot.kinds()


def test_a_light_arm_stops_harder_than_a_loaded_one():
    state = Q1, [1.5, 0, 0, 0, 0, 0], np.zeros(6)
    assert plan(*state, payload=Payload()).acceleration > plan(*state).acceleration


def test_a_gentle_wish_is_kept():
    assert plan(Q3, [0.5, 0, 0, 0, 0, 0], np.zeros(6), 2.0).acceleration == 2.0


def test_a_wish_beyond_the_torque_is_limited():
    free = plan(Q1, [1.5, 1.0, 0, 0, 0, 0], np.zeros(6))
    stop = plan(Q1, [1.5, 1.0, 0, 0, 0, 0], np.zeros(6), 39.0)
    assert stop.acceleration < 39.0
    assert stop.acceleration == pytest.approx(free.acceleration, rel=0.25)


def test_a_wish_beyond_the_arm_s_limit_is_limited():
    assert plan(Q3, [0.01, 0, 0, 0, 0, 0], np.zeros(6), 1e5).acceleration <= min(LIMITS.acceleration)


@pytest.mark.parametrize("wanted", [5e-324, 1e-9, 1e-3, 0.5])
def test_no_stop_lasts_for_ever(wanted):
    stop = plan(Q3, [1.5, 0, 0, 0, 0, 0], np.zeros(6), wanted)
    assert stop.acceleration == GENTLEST_STOP
    assert stop.duration < 2.0


def test_a_wish_that_would_end_beyond_the_joint_s_range_is_overruled():
    q = (6.0, *Q3[1:])
    stop = plan(q, [1.0, 0, 0, 0, 0, 0], np.zeros(6), 1.0)
    assert stop.acceleration > 1.0
    assert stop.at(9.0)[0][0] < LIMITS.position[0]


def test_a_motion_that_already_takes_more_than_the_share_is_not_stopped_the_more_gently():
    """A robot whose shoulder hardly holds its arm: the base can be stopped as hard as ever."""
    weak = msgspec.structs.replace(LIMITS, torque=(150.0, 80.0, 150.0, 28.0, 28.0, 28.0))
    description = msgspec.structs.replace(UR5E, limits=weak)
    state = Q1, [1.0, 0, 0, 0, 0, 0], np.zeros(6)
    gravity = InverseDynamics(UR5E, DISC).gravity(Q1)
    assert abs(gravity[1]) > TORQUE_SHARE * 80.0
    assert plan(*state, description=description).acceleration > GENTLEST_STOP


def test_at_rest_there_is_nothing_to_stop():
    stop = plan(Q1, np.zeros(6), np.zeros(6))
    assert stop.finished
    assert (stop.next() == Q1).all()


@pytest.mark.parametrize("seed", range(10))
def test_a_motion_with_the_acceleration_that_its_way_leaves_keeps_its_share_of_torque(seed):
    random = np.random.default_rng(seed)
    start, target = random.uniform(-2, 2, (2, 6))
    line, dynamics, most = JointLine(start, target), InverseDynamics(UR5E, DISC), np.array(LIMITS.torque)
    velocity = random.uniform(0.5, 3.1)
    room = acceleration_on_way(dynamics, line, start, target - start, velocity, most)
    motion, q = quickest_motion(line, MotionLimits(velocity, room, 2000.0), H), [start, start]
    while not motion.finished:
        q.append(motion.next())
    q = np.array(q)
    qd, qdd = (q[2:] - q[:-2]) / (2 * H), np.diff(q, 2, axis=0) / H**2
    taken = np.abs([dynamics.torque(*state) for state in zip(q[1:-1], qd, qdd, strict=True)])
    # Seventeen places on the way, and the motion is in between, too.
    assert (taken <= 1.03 * TORQUE_SHARE * most).all()


def test_the_acceleration_that_a_way_leaves_uses_its_share_somewhere():
    start, way = np.array(Q1), np.array([0.5, 0.4, -0.3, 0.0, 0.2, 0.0])
    dynamics, limits = InverseDynamics(UR5E, DISC), np.array(LIMITS.torque)
    room = acceleration_on_way(dynamics, JointLine(start, start + way), start, way, 0.5, limits)
    along, used = way / np.abs(way).max(), 0.0
    for share in np.linspace(0.0, 1.0, 17):
        q, still = start + share * way, np.zeros(6)
        turning = np.abs(dynamics.torque(q, 0.5 * along, still))
        pushed = np.abs(dynamics.torque(q, still, along) - dynamics.gravity(q))
        resting = np.maximum(turning, np.abs(dynamics.gravity(q)))
        used = max(used, float(((resting + room * pushed) / limits).max()))
    assert used == pytest.approx(TORQUE_SHARE, rel=1e-6)

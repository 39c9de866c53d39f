"""Planning of stops: as hard as the joints' torque allows."""

import msgspec
import numpy as np
import pytest

from tvist_plant.description import Payload
from tvist_protocol import commands as c
from tvist_server.control.differentiator import Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.safety import GENTLEST_STOP, REBOUND, STEP, TORQUE_SHARE, plan_stop

from .robots import Q1, Q3, UR5E, H, Robot

DISC = UR5E.payload
LIMITS = UR5E.limits


def plan(q, qd, qdd, wanted=None, *, payload=DISC, description=UR5E):
    state = Target(*(np.array(values, dtype=float) for values in (q, qd, qdd)))
    return plan_stop(description, InverseDynamics(description, payload), state, wanted, H)


def torques(stop, payload=DISC):
    """Along the whole stop, the start first, ten times as fine as the plan looks."""
    dynamics = InverseDynamics(UR5E, payload)
    times = np.linspace(0.0, stop.trajectory.duration, 121)
    return np.array([np.abs(dynamics.torque(*stop.trajectory.at(time))) for time in times])


def moving(seed):
    random = np.random.default_rng(seed)
    return random.uniform(-3, 3, 6), random.uniform(-1.5, 1.5, 6), random.uniform(-2, 2, 6)


@pytest.mark.parametrize("seed", range(25))
def test_the_torque_stays_within_its_share_unless_the_motion_already_takes_more(seed):
    """Two percent for what lies between the plan's samples."""
    stop = plan(*moving(seed))
    taken = torques(stop)
    most = np.maximum(TORQUE_SHARE * np.array(LIMITS.torque), taken[0])
    assert stop.acceleration == GENTLEST_STOP or (taken <= 1.02 * most).all()


@pytest.mark.parametrize("seed", range(25))
def test_it_is_no_gentler_than_it_must_be(seed):
    """One step harder would pass the share, or the limit with what swings: the plan's search, the other way round."""
    q, qd, qdd = moving(seed)
    stop = plan(q, qd, qdd)
    if stop.acceleration < min(LIMITS.acceleration):
        dynamics = InverseDynamics(UR5E, DISC)
        harder = type(stop.trajectory)(
            q, qd, qdd, acceleration=stop.acceleration / STEP, jerk=2000.0, period=H
        )
        states = [harder.at(time) for time in np.linspace(0.0, harder.duration, 400)]
        taken = np.array([dynamics.torque(*state) for state in states])
        gravity = np.array([dynamics.gravity(state[0]) for state in states])
        before = dynamics.torque(q, qd, qdd) - dynamics.gravity(np.array(q))
        swung = taken + REBOUND * (taken - gravity - before)
        back = gravity - REBOUND * (taken - gravity)
        limit = np.array(LIMITS.torque)
        beyond = np.array([np.abs(taken) > TORQUE_SHARE * limit, np.abs(swung) > limit, np.abs(back) > limit])
        assert beyond.any()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_a_stop_is_no_protective_stop(seed):
    """The flexible arm swings beyond what is asked of it, but never for more than 10 ms beyond its drives' limits."""
    random = np.random.default_rng(seed)
    robot = Robot(seed=seed)
    if seed % 2:
        robot.send(c.SimulationReset, q=tuple(Q3))
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


def test_a_gentle_wish_is_kept_and_nothing_is_limited():
    stop = plan(Q3, [0.5, 0, 0, 0, 0, 0], np.zeros(6), 2.0)
    assert (stop.acceleration, stop.limited) == (2.0, False)


def test_a_wish_beyond_the_torque_is_limited_and_says_so():
    free = plan(Q1, [1.5, 1.0, 0, 0, 0, 0], np.zeros(6))
    stop = plan(Q1, [1.5, 1.0, 0, 0, 0, 0], np.zeros(6), 39.0)
    assert stop.limited
    assert stop.acceleration < 39.0
    assert stop.acceleration == pytest.approx(free.acceleration, rel=0.25)
    assert not free.limited


def test_a_wish_beyond_the_arm_s_limit_is_limited():
    stop = plan(Q3, [0.01, 0, 0, 0, 0, 0], np.zeros(6), 1e5)
    assert stop.limited
    assert stop.acceleration <= min(LIMITS.acceleration)


@pytest.mark.parametrize("wanted", [5e-324, 1e-9, 1e-3, 0.5])
def test_no_stop_lasts_for_ever(wanted):
    stop = plan(Q3, [1.5, 0, 0, 0, 0, 0], np.zeros(6), wanted)
    assert (stop.acceleration, stop.limited) == (GENTLEST_STOP, True)
    assert stop.trajectory.duration < 2.0


def test_a_wish_that_would_end_beyond_the_joint_s_range_is_overruled():
    q = (6.0, *Q3[1:])
    stop = plan(q, [1.0, 0, 0, 0, 0, 0], np.zeros(6), 1.0)
    assert stop.limited
    assert stop.acceleration > 1.0
    assert stop.trajectory.at(9.0)[0][0] < LIMITS.position[0]


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
    assert stop.trajectory.finished
    assert (stop.trajectory.next() == Q1).all()

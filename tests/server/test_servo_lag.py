"""Set-points that compensate the lag of the servo bring the arm to the reference, within all limits."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.controller.robots import Q1, Q3, UR5E
from tests.examples import examples

from tvist_controller.line.differentiator import central_differences
from tvist_controller.line.limits import arm_limits
from tvist_controller.trajectory import JointLine, MotionLimits, ServoFollower, quickest_motion
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import PERIOD
from tvist_server.moving.program import GAIN, LOOKAHEAD
from tvist_server.moving.servo_lag import ServoLag, ServoSetpoints

REACH = np.array(UR5E.limits.position)
FAST = 10.0


class AnyTorque:
    """Torque without limits."""

    allows = staticmethod(lambda *_: True)
    acceleration = staticmethod(lambda *_: np.inf)


def commands(start, end, limits):
    """Return the drive commands of a motion with rests around it."""
    motion, q = quickest_motion(JointLine(start, end), limits), [start] * 5
    while not motion.finished:
        q.append(motion.next())
    q, qd, _ = central_differences(np.array([*q, *[q[-1]] * 300]))
    return [DriveCommand(*both, np.zeros(6)) for both in zip(q, qd, strict=True)]


def errors(lag, lookahead=LOOKAHEAD, gain=GAIN):
    """Return the largest deviation of a joint from its reference at each tick [rad]."""
    motion = commands(Q1, Q3, MotionLimits(1.5, 2.0, 100.0))
    start = motion[0].q
    servo = ServoFollower((start, 0.0 * start, 0.0 * start), arm_limits(UR5E), REACH, AnyTorque())
    setpoints, apart = ServoSetpoints(start, lag, fastest=FAST, reach=REACH), []
    for command in motion:
        servo.aim(setpoints.next(command), lookahead, gain)
        apart.append(np.abs(servo.next() - command.q).max())
    assert setpoints.limited == 0
    return np.array(apart)


@pytest.mark.parametrize(("lookahead", "gain"), [(0.03, 2000), (0.2, 100)])
def test_compensated_set_points_bring_the_arm_to_the_reference(lookahead, gain):
    late = errors(None, lookahead, gain)
    led = errors(ServoLag.simulated(lookahead, gain), lookahead, gain)
    assert late.max() > 1.4 * lookahead
    assert led.max() < 1e-5
    assert led[-1] == 0.0


def test_a_lag_wrong_by_10_percent_leaves_10_percent_of_the_error():
    true = ServoLag.simulated()
    wrong = errors(ServoLag(0.9 * true.time, 0.9 * true.gain))
    assert 0.05 < wrong.max() / errors(None).max() < 0.15
    assert wrong[-1] == 0.0


def test_rounding_errors_grow_by_less_than_10000():
    random, q = np.random.default_rng(0), np.full(6, 3.0)
    setpoints = ServoSetpoints(q, ServoLag.simulated(), fastest=FAST, reach=REACH)
    noise = 1e-15 * random.standard_normal((200, 6))
    for before, now, after in zip(noise, noise[1:], noise[2:], strict=False):
        command = DriveCommand(q + now, (after - before) / (2 * PERIOD), np.zeros(6))
        assert np.abs(setpoints.next(command) - q).max() < 1e-11


@given(st.integers(0, 2**31), st.floats(0.05, 3.2))
@example(0, 0.05)
@example(0, 0.5)
@examples(10)
def test_set_points_keep_range_and_speed_and_reach_rest(seed, fastest):
    random = np.random.default_rng(seed)
    q = random.uniform(-6.0, 6.0, 6)
    setpoints, sent = ServoSetpoints(q, ServoLag.simulated(), fastest=fastest, reach=REACH), [q]
    assert (setpoints.next(DriveCommand(q, np.zeros(6), np.zeros(6))) == q).all()
    for _ in range(100):
        velocity = random.uniform(-30.0, 30.0, 6)
        q = np.clip(q + PERIOD * velocity, -REACH, REACH)
        sent.append(setpoints.next(DriveCommand(q, velocity, np.zeros(6))))
    assert setpoints.limited > 0
    steps = np.abs(q - sent[-1]).max() / (fastest * PERIOD)
    most, rest = int(steps) + 4, DriveCommand(q, np.zeros(6), np.zeros(6))
    sent += [setpoints.next(rest) for _ in range(most)]
    table = np.array(sent)
    assert np.abs(np.diff(table, axis=0)).max() <= fastest * PERIOD * (1.0 + 1e-9)
    assert (np.abs(table) <= REACH).all()
    assert (table[-1] == q).all()


def test_compensation_does_not_exceed_the_range_of_a_joint():
    """When the arm brakes hard at its end, the compensation would otherwise exceed the range."""
    setpoints = ServoSetpoints(REACH - 0.5, ServoLag.simulated(), fastest=FAST, reach=REACH)
    motion = commands(REACH - 0.5, REACH, MotionLimits(3.0, 20.0, 2000.0))
    sent = np.array([setpoints.next(command) for command in motion])
    assert sent.max() <= REACH.max()
    assert setpoints.limited > 0
    assert (sent[-1] == REACH).all()

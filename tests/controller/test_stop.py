"""Stops: their trajectories, at random moments of a motion."""

import numpy as np
import pytest

from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import DECELERATION_RATIO, StopPlanner
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Target
from tvist_controller.line.limits import GENTLEST_STOP, TORQUE_SHARE, StopTorque, acceleration_on_way
from tvist_controller.line.line_mode import LineMode
from tvist_controller.trajectory import JointLine, MotionLimits, quickest_motion
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import PAPER, Q1, Q2, Q3, UR5E, H, NoArm, Robot, without_arm


def test_a_stop_is_no_later_and_no_further_than_the_move(robot):
    """If no deceleration on the ladder keeps the torque limits, the move itself is the stop."""
    robot.send(SimulationReset, q=(0.0, -1.57, 0.0, -1.57, 0.0, 0.0))
    limits = {"velocity": 3.14, "acceleration": 4.0, "jerk": 2000.0}
    target = (0.0, -0.2, 0.0, -1.57, 0.0, 0.0)
    lasted = []
    for end in (
        lambda: None,
        lambda: robot.controller.client_gone("a", "1f"),
        lambda: robot.send(SimulationInject, fault="protective_stop"),
        lambda: robot.send(c.PowerOff),
    ):
        robot.token = robot.controller.receive(c.TakeControl(client="a"), session="1f").token
        robot.send(SimulationReset, q=(0.0, -1.57, 0.0, -1.57, 0.0, 0.0), mode="RUNNING")
        started = robot.controller.tick_number
        assert isinstance(robot.send(c.MoveJ, q=target, **limits), Accepted)
        robot.tick(250)
        end()
        lasted.append(robot.until_rest().tick - started)
        assert max(state.target_q[1] for state in robot.states) <= target[1] + 1e-9
    assert max(lasted) == lasted[0]


def test_a_move_beyond_a_torque_limit_is_slower_with_a_warning():
    robot = Robot(shaper="none")
    robot.send(SimulationReset, q=(0.0, -0.9, 0.0, -1.57, 0.0, 0.0))
    target = (0.0, -0.3, 0.0, -1.57, 0.0, 0.0)
    reply = robot.send(c.MoveJ, q=target, velocity=3.0, acceleration=8.0, jerk=500.0)
    robot.until_rest()
    told = [event.why for event in robot.events if event.kind == "warning" and event.code == "limit_torque"]
    assert told == [reply.limited]
    assert reply.limited.endswith("of 8 rad/s², so that the torque of joint shoulder stays within 150 N m")
    most = np.abs(robot.column("target_moment")[:, 1]).max()
    assert 0.99 * UR5E.limits.torque[1] < most <= (1.0 + 1e-3) * UR5E.limits.torque[1]
    assert Robot().send(c.MoveJ, q=tuple(Q3)).limited is None


def test_only_a_harder_stop_replaces_a_gentle_one():
    def way(*decelerations):
        line = without_arm()
        line.begin(line.plan(Q2, PAPER))
        stopper = Stopper(line)
        for deceleration, ticks in zip(decelerations, (450, 20), strict=False):
            for _ in range(ticks):
                line.step()
            stopper.stop(deceleration)
        while not line.at_rest:
            line.step()
        return line.position[0]

    assert way(2.0, None) < way(2.0) - 0.1
    assert way(2.0, 1.0) == way(2.0)
    assert way(None, 1.0) == way(None)


def test_a_harder_stop_lets_a_motion_run_out_that_already_does():
    ran_out = 0
    for moment in range(532, 536):  # about to rest, so in some of them no stop is as quick
        robot = Robot(plant=NoArm())
        robot.send(c.MoveJ, q=tuple(Q1 + 0.5))
        robot.tick(moment)
        robot.send(c.Stop, deceleration=1.0)
        ran_out += robot.controller.cycle.mode is LineMode.RUNNING_OUT
        assert robot.send(c.Stop) == Done()
        robot.until_rest()
        assert robot.kinds().count("motion_stopped") == 1
    assert ran_out


@pytest.mark.parametrize(("name", "way"), [("um_zv", 0.003), ("um_zv", 0.6), ("um_zvd", 0.05)])
def test_with_negative_impulses_a_motion_is_done_after_all_echoes(robot, name, way):
    """Echoes cancel for a moment: a shaped reference that stands still may move again."""
    robot.send(c.SetEstimator, name="fixed", f_d=(5.0,), zeta=(0.05,))
    robot.send(c.SetShaper, name=name)
    robot.send(c.MoveJ, q=tuple(Q3 + way * (Q1 - Q3)) if way > 0.5 else tuple(Q1 + way))
    robot.until_rest()
    rested = robot.controller.cycle.position
    robot.tick(300)
    assert np.abs(robot.column("target_q")[-250:] - rested).max() < 1e-7


DISC = UR5E.payload
LIMITS = UR5E.limits


def plan(q, qd, qdd, wanted=None, *, payload=DISC, description=UR5E, clear=lambda _: True):
    """Return the stop of independent joints, as for a stream."""
    state = Target(*(np.array(values, dtype=float) for values in (q, qd, qdd)))
    planner = StopPlanner(description, InverseDynamics(description, payload))
    return planner.by_joints(state, wanted, clear)


@pytest.mark.parametrize("seed", range(4))
def test_a_stop_uses_the_hardest_deceleration_within_torque_limits(seed):
    """Each deceleration is checked by itself: a gentler stop may fail where a harder one does."""
    random = np.random.default_rng(seed)
    moving = [random.uniform(-most, most, 6) for most in (3, 1.5, 2)]
    stop, state = plan(*moving), Target(*moving)
    torque = StopTorque(InverseDynamics(UR5E, DISC), state, np.array(LIMITS.torque))
    planner = StopPlanner(UR5E, InverseDynamics(UR5E, DISC))
    tried = [min(LIMITS.acceleration) * DECELERATION_RATIO**k for k in range(16)]
    held = [a for a in tried if torque.holds(planner.stop(state, a))]
    if held:
        assert stop.acceleration == pytest.approx(max(held))
    elif stop is not None:  # none keeps what the flexible arm swings beyond, too
        assert torque.holds(stop, rebound=False) or stop.acceleration == GENTLEST_STOP


def test_a_colliding_stop_is_replaced_by_a_clear_one():
    state = Q3, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], np.zeros(6)
    free = plan(*state)
    assert plan(*state, clear=lambda stop: stop.acceleration < 5.0).acceleration < 5.0 < free.acceleration
    assert plan(*state, clear=lambda _: False) is None
    gentle = plan(*state, 1.0, clear=lambda stop: stop.duration < 0.3)
    assert gentle.duration < 0.3
    assert gentle.acceleration < free.acceleration, "hardened until it is clear, and no more"


@pytest.mark.parametrize("seed", range(3))
def test_a_stop_causes_no_torque_overload(seed):
    """The flexible arm overshoots the demand, but never exceeds its drives' limits for more than 10 ms."""
    random = np.random.default_rng(seed)
    robot = Robot(seed=seed)
    if seed % 2:
        robot.send(SimulationReset, q=tuple(Q3))
    robot.tick()
    swing, pace = random.uniform(-0.3, 0.3, 6), random.uniform(1.5, 3.0)
    robot.stream(int(random.integers(200, 600)), swing, pace)
    robot.send(c.Stop)
    robot.tick(300)
    assert "protective_stop" not in robot.kinds()


@pytest.mark.parametrize("wanted", [5e-324, 1e-9, 1e-3, 0.5])
def test_very_gentle_stops_use_the_gentlest_deceleration(wanted):
    stop = plan(Q3, [1.5, 0, 0, 0, 0, 0], np.zeros(6), wanted)
    assert stop.acceleration == GENTLEST_STOP
    assert stop.duration < 2.0


def test_a_stop_that_would_leave_the_joint_range_is_harder():
    q = (6.0, *Q3[1:])
    stop = plan(q, [1.0, 0, 0, 0, 0, 0], np.zeros(6), 1.0)
    assert stop.acceleration > 1.0
    assert stop.at(9.0)[0][0] < LIMITS.position[0]


@pytest.mark.parametrize("seed", range(4))
def test_the_acceleration_on_a_path_keeps_its_torque_share(seed):
    random = np.random.default_rng(seed)
    start, target = random.uniform(-2, 2, (2, 6))
    line, dynamics, most = JointLine(start, target), InverseDynamics(UR5E, DISC), np.array(LIMITS.torque)
    velocity = random.uniform(0.5, 3.1)
    room = acceleration_on_way(dynamics, line, start, target - start, velocity, most)
    motion, q = quickest_motion(line, MotionLimits(velocity, room, 2000.0)), [start, start]
    while not motion.finished:
        q.append(motion.next())
    q = np.array(q)
    qd, qdd = (q[2:] - q[:-2]) / (2 * H), np.diff(q, 2, axis=0) / H**2
    taken = np.abs([dynamics.torque(*state) for state in zip(q[1:-1], qd, qdd, strict=True)])
    # Seventeen places on the way, and the motion is in between, too.
    assert (taken <= 1.03 * TORQUE_SHARE * most).all()

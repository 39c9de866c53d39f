"""Power, protective stops and reduced speed follow the table of transitions."""

import numpy as np
import pytest

from tvist_controller.line.limits import REDUCED_SHARE
from tvist_controller.motion.monitors import TICKS
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset
from tvist_protocol.transitions import TRANSITIONS, Activity, after

from .robots import Q1, Q2, Q3, UR5E, H, NoArm, Robot

Q2_, Q3_ = tuple(Q2), tuple(Q3)
FASTEST = REDUCED_SHARE * min(UR5E.limits.velocity)
COMMANDS = {
    "power_on": (c.PowerOn, {}),
    "power_off": (c.PowerOff, {}),
    "unlock_protective_stop": (c.UnlockProtectiveStop, {}),
    "move_j": (c.MoveJ, {"q": Q2_}),
    "servo_start": (c.ServoStart, {}),
    "servo_stop": (c.ServoStop, {}),
    "pause": (c.Pause, {}),
    "resume": (c.Resume, {}),
    "stop": (c.Stop, {}),
    "servo_j": (m.ServoJ, {"q": Q2_}),
    "speed_j": (m.SpeedJ, {"qd": (0.1,) * 6}),
    "speed_l": (m.SpeedL, {"xd": (0.0, 0.0, -0.05, 0.0, 0.0, 0.0)}),
    "stop_j": (m.StopJ, {}),
    "stop_l": (m.StopL, {}),
}
STOPS = {"stop", "stop_j", "stop_l"}


def at(activity: Activity, **changes) -> Robot:
    """Return a robot brought into an activity by commands."""
    robot = Robot(**changes)
    if activity in {Activity.POWER_OFF, Activity.IDLE}:
        robot.send(SimulationReset, mode=activity.value)
    elif activity in {Activity.STREAMING, Activity.ENDING}:
        robot.stream(100)
        if activity is Activity.ENDING:
            robot.send(c.ServoStop)
    elif activity is Activity.GUIDED:
        robot.send(m.ServoJ, q=Q3_)
        robot.tick(40)
    elif activity is Activity.PROTECTIVE_STOP:
        robot.send(SimulationInject, fault="protective_stop")
    elif activity is not Activity.REST:
        robot.move(120)
        ends = {
            Activity.PAUSED: (c.Pause, {}),
            Activity.STOPPING: (c.Stop, {}),
            Activity.POWERING_OFF: (c.PowerOff, {}),
            Activity.PROTECTIVE_STOPPING: (SimulationInject, {"fault": "protective_stop"}),
            Activity.BRAKING: (SimulationInject, {"fault": "power_loss"}),
        }
        if activity in ends:
            robot.send(ends[activity][0], **ends[activity][1])
    robot.tick()
    assert robot.controller.motion.activity is activity
    return robot


@pytest.mark.parametrize("activity", Activity)
def test_commands_follow_the_transition_table(activity):
    refusing = at(activity, plant=NoArm())
    for command, (kind, fields) in COMMANDS.items():
        target = after(activity, command)
        robot = refusing if target is None else at(activity, plant=NoArm())
        reply = robot.send(kind, **fields)
        assert robot.controller.motion.activity is (target or activity), command
        if target is not None:
            assert isinstance(reply, Accepted | Done), reply
        elif command in STOPS:
            assert reply == Done()
        else:
            assert isinstance(reply, Refused), command
            assert reply.code in {"busy", "wrong_mode"}
            assert (reply.code == "busy") <= activity.moving


def test_each_trigger_has_one_target_per_activity():
    pairs = [(row.trigger, source) for row in TRANSITIONS for source in row.sources]
    assert len(pairs) == len(set(pairs))


def test_power_off_stops_the_arm_before_cutting_power():
    robot = at(Activity.MOVING)
    assert robot.send(c.PowerOff) == Done()
    assert robot.tick().robot_mode == RobotMode.RUNNING
    robot.until_rest()
    assert robot.tick().robot_mode == RobotMode.POWER_OFF
    assert robot.kinds() == ["motion_started", "motion_stopped"]
    peak = np.abs(np.diff(robot.column("target_q"), 2, axis=0) / H**2).max()
    assert peak <= UR5E.limits.acceleration[0] * (1 + 1e-6)
    stood = robot.states[-1].actual_q
    robot.tick(500)
    assert robot.states[-1].actual_q == pytest.approx(stood, abs=5e-3)  # it still rang


@pytest.mark.parametrize(("push", "stops"), [(-200.0, False), (-300.0, None), (-1000.0, True)])
def test_only_a_lasting_torque_overload_causes_a_protective_stop(robot, push, stops):
    robot.tick(10)
    robot.send(SimulationInject, fault="torque", joint=1, value=push, seconds=0.004)
    robot.tick(100)
    beyond = np.abs(robot.column("actual_moment")) > np.array(UR5E.limits.torque)
    assert beyond.any()
    stopped = robot.told("protective_stop")
    lasting = [k for k in range(TICKS, len(beyond)) if beyond[k - TICKS : k + 1].all(axis=0).any()]
    assert bool(stopped) == bool(lasting)
    assert stops in {None, bool(lasting)}
    if stopped:
        assert stopped[0].code == "limit_torque"
        assert "beyond its" in stopped[0].why
        assert stopped[0].tick == robot.states[lasting[0]].tick


@pytest.mark.parametrize("activity", Activity)
def test_a_non_finite_arm_is_placed_at_rest_and_can_be_used_again(activity):
    robot = at(activity)
    assert robot.send(SimulationInject, fault="nan") == Done()
    state = robot.tick()
    assert [event.kind for event in robot.events if event.code == "plant_failure"][-1] == "protective_stop"
    driven = activity.name not in {"POWER_OFF", "IDLE", "BRAKING", "POWERING_OFF"}
    assert state.safety_mode == (SafetyMode.PROTECTIVE_STOP if driven else SafetyMode.NORMAL)
    ended = [event for event in robot.events if event.kind in {"motion_done", "motion_stopped"}]
    assert len(ended) == robot.kinds().count("motion_started")
    robot.tick(100)
    assert np.isfinite(robot.column("actual_q")).all()
    if driven:
        assert robot.send(c.UnlockProtectiveStop) == Done()
        back = tuple(0.9 * np.array(robot.states[-1].target_q) + 0.1 * Q1)
        assert isinstance(robot.send(c.MoveJ, q=back), Accepted)


def speeds(robot, since=0):
    return np.abs(np.diff(robot.column("target_q")[since:], axis=0) / H).max(axis=1)


@pytest.mark.parametrize(("shaper", "ticks"), [("none", 20), ("zv", 300), ("zv", 900)])
def test_reduced_mode_slows_down_a_running_motion_temporarily(shaper, ticks):
    robot = Robot(shaper=shaper)
    robot.send(c.MoveJ, q=Q3_)
    robot.tick(ticks)
    robot.send(SimulationInject, fault="reduced", seconds=2.0)
    assert robot.tick().safety_mode == SafetyMode.REDUCED
    robot.tick(400)
    assert speeds(robot, ticks + 300).max() <= FASTEST * (1 + 1e-3)
    robot.tick(600)
    assert robot.states[-1].safety_mode == SafetyMode.NORMAL
    robot.until_rest()
    assert "motion_done" in robot.kinds()
    assert robot.states[-1].target_q == pytest.approx(Q3_, abs=1e-6)
    peak = np.abs(np.diff(robot.column("target_q"), 2, axis=0) / H**2).max()
    # Where its time is paced, a tick is not infinitely short: 0.1 %. The time-varying shaper adds up to 2 %.
    assert peak <= 2.0 * (1.02 if shaper == "zv" else 1.001)


def test_a_new_motion_keeps_the_reduced_speed(robot):
    robot.send(SimulationInject, fault="reduced")
    robot.send(c.MoveJ, q=Q3_)
    robot.until_rest(20000)
    assert 0.9 * FASTEST < speeds(robot).max() <= FASTEST * (1 + 1e-3)
    assert robot.send(SimulationInject, fault="normal") == Done()
    assert robot.tick().safety_mode == SafetyMode.NORMAL


def test_reduced_mode_stops_and_refuses_streams_that_are_too_fast():
    robot = at(Activity.STREAMING)
    robot.send(SimulationInject, fault="reduced")
    robot.until_rest()
    stopped = robot.told("stream_stopped")
    assert [event.code for event in stopped] == ["limit_velocity"]
    reply = robot.send(c.ServoStart)
    assert (reply.code, reply.where, reply.limit) == ("limit_velocity", "velocity", pytest.approx(FASTEST))
    assert robot.send(c.ServoStart, velocity=0.5) == Done()

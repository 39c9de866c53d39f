"""Stops of UR's categories 0, 1 and 2, and what the safety system keeps."""

import numpy as np
import pytest

from tvist_controller.instruments.variables import SAFETY_BITS
from tvist_controller.line.differentiator import Target
from tvist_controller.safety.brakes import brake
from tvist_controller.setup import body, paper_payload
from tvist_protocol import commands as c
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q1, Q2, Q3, UR5E, H, Robot

MOVE = {"q": tuple(Q3)}


def inject(robot, fault, **fields):
    assert robot.send(SimulationInject, fault=fault, **fields) == Done()


def told(robot, kind):
    return [event for event in robot.events if event.kind == kind]


def moving(ticks=300):
    robot = Robot()
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)
    robot.tick(ticks)
    return robot


def test_a_safeguard_stop_pauses_the_motion_and_its_release_lets_it_go_on():
    robot = moving()
    inject(robot, "safeguard_stop")
    robot.tick(1500)
    state = robot.states[-1]
    assert (state.safety_mode, state.runtime_state) == (SafetyMode.SAFEGUARD_STOP, RuntimeState.PAUSED)
    assert state.robot_mode == RobotMode.RUNNING
    assert [event.category for event in told(robot, "safety_stop")] == [2]
    assert robot.send(c.Resume).code == "wrong_mode"
    assert robot.send(c.MoveJ, **MOVE).code == "busy"
    inject(robot, "normal")
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"
    assert robot.states[-1].safety_mode == SafetyMode.NORMAL
    assert robot.states[-1].target_q == pytest.approx(list(Q3), abs=1e-6)


def test_a_safeguard_stop_of_some_seconds_ends_by_itself():
    robot = moving()
    inject(robot, "safeguard_stop", seconds=2.0)
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"


def test_a_motion_that_its_client_paused_waits_for_its_client():
    robot = moving()
    robot.send(c.Pause)
    inject(robot, "safeguard_stop")
    robot.tick(1500)
    inject(robot, "normal")
    robot.tick(500)
    assert robot.states[-1].runtime_state == RuntimeState.PAUSED
    other = moving()
    inject(other, "safeguard_stop")
    other.send(c.Pause)
    other.tick(1500)
    inject(other, "normal")
    other.tick(500)
    assert other.states[-1].runtime_state == RuntimeState.PAUSED
    assert other.send(c.Resume) == Done()
    other.until_rest()
    assert other.kinds()[-1] == "motion_done"


def test_at_rest_a_safeguard_keeps_the_arm_where_it_is():
    robot = Robot()
    inject(robot, "safeguard_stop")
    for kind, fields in ((c.MoveJ, MOVE), (c.ServoStart, {})):
        reply = robot.send(kind, **fields)
        assert (reply.code, "SAFEGUARD_STOP" in reply.why) == ("wrong_mode", True)
    assert robot.tick().safety_mode == SafetyMode.SAFEGUARD_STOP
    inject(robot, "normal")
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)


def test_a_stream_ends_by_a_safeguard_stop():
    robot = Robot()
    assert robot.send(c.ServoStart) == Done()
    for k in range(100):
        robot.setpoint(k, Q1 + 0.1 * (1 - np.cos(3.0 * k * H)))
        robot.tick()
    inject(robot, "safeguard_stop")
    robot.until_rest()
    assert [event.category for event in told(robot, "stream_stopped")] == [2]


@pytest.mark.parametrize(
    ("fault", "mode"),
    [
        ("emergency_stop", SafetyMode.ROBOT_EMERGENCY_STOP),
        ("system_emergency_stop", SafetyMode.SYSTEM_EMERGENCY_STOP),
    ],
)
def test_an_emergency_stop_stops_on_the_way_and_takes_the_power_until_it_is_released(fault, mode):
    robot = moving()
    inject(robot, fault)
    first = robot.tick()
    assert (first.safety_mode, first.robot_mode) == (mode, RobotMode.RUNNING), (
        "the drives still brake the arm"
    )
    rested = robot.until_rest()
    assert (rested.safety_mode, rested.robot_mode) == (mode, RobotMode.POWER_OFF)
    way = np.array(rested.target_q) - Q1
    assert np.abs(way - (way @ (Q3 - Q1)) / ((Q3 - Q1) @ (Q3 - Q1)) * (Q3 - Q1)).max() < 1e-9
    stop = told(robot, "safety_stop")[0]
    assert stop.category == 1
    assert stop.duration == pytest.approx((rested.tick - stop.tick) * H, abs=4 * H)
    assert told(robot, "motion_stopped")[0].category == 1
    refused = robot.send(c.PowerOn)
    assert refused.code == "wrong_mode"
    assert "release the emergency stop" in refused.why
    inject(robot, "normal")
    assert robot.tick().safety_mode == SafetyMode.NORMAL
    assert robot.send(c.PowerOn) == Done()
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)


@pytest.mark.parametrize("fault", ["violation", "fault"])
def test_a_violation_or_fault_closes_the_brakes_and_stays_until_safety_is_restarted(fault):
    robot = moving(500)
    inject(robot, fault)
    mode = SafetyMode[fault.upper()]
    first = robot.tick()
    assert (first.safety_mode, first.robot_mode) == (mode, RobotMode.POWER_OFF)
    rested = robot.until_rest()
    assert rested.safety_mode == mode
    stop = told(robot, "safety_stop")[0]
    assert stop.category == 0
    assert stop.duration == pytest.approx((rested.tick - stop.tick) * H, abs=4 * H)
    inject(robot, "normal")
    for command in (c.PowerOn, c.UnlockProtectiveStop, c.Resume):
        assert robot.send(command).code == "wrong_mode"
    assert "restart_safety" in robot.send(c.PowerOn).why
    assert robot.send(c.RestartSafety) == Done()
    state = robot.tick()
    assert (state.safety_mode, state.robot_mode) == (SafetyMode.NORMAL, RobotMode.POWER_OFF)
    assert robot.send(c.PowerOn) == Done()
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"


def test_there_is_nothing_to_restart_where_nothing_was_found():
    assert isinstance(Robot().send(c.RestartSafety), Refused)


def test_a_loss_of_power_brakes_at_once_and_leaves_the_safety_system_alone():
    robot = moving(500)
    plain = moving(500)
    inject(robot, "power_loss")
    plain.send(c.Stop)
    rested = robot.until_rest()
    assert (rested.safety_mode, rested.robot_mode) == (SafetyMode.NORMAL, RobotMode.POWER_OFF)
    assert robot.send(c.PowerOn) == Done()


def test_a_reset_to_a_mode_ends_every_stop():
    for fault in ("safeguard_stop", "emergency_stop", "violation", "fault", "power_loss"):
        robot = moving()
        inject(robot, fault)
        robot.tick(2)
        assert isinstance(robot.send(SimulationReset, q=tuple(Q2), mode="RUNNING"), Done)
        assert robot.tick().safety_mode == SafetyMode.NORMAL
        assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)


def test_every_safety_mode_has_its_bit():
    """RTDE's numbers: bit 5 system emergency stop, 6 robot, 7 either, 8 violation, 9 fault, 10 stopped by safety."""
    bits = {mode: {bit for bit in range(11) if SAFETY_BITS[mode] >> bit & 1} for mode in SAFETY_BITS}
    assert bits[SafetyMode.SAFEGUARD_STOP] == {4, 10}
    assert bits[SafetyMode.SYSTEM_EMERGENCY_STOP] == {5, 7, 10}
    assert bits[SafetyMode.ROBOT_EMERGENCY_STOP] == {6, 7, 10}
    assert bits[SafetyMode.VIOLATION] == {8, 10}
    assert bits[SafetyMode.FAULT] == {9, 10}


@pytest.mark.parametrize("seed", range(12))
def test_brakes_bring_the_arm_to_rest_and_take_energy_all_the_way(seed):
    """Joints never speed up by the brakes themselves, each stays once it rests, and all rest in the end."""
    random = np.random.default_rng(seed)
    state = Target(random.uniform(-3, 3, 6), random.uniform(-3, 3, 6), np.zeros(6))
    way = brake(UR5E, body(paper_payload(UR5E, float(random.uniform(0, 5)))), state, H)
    q = [state.q]
    while not way.finished:
        q.append(way.next())
    steps = np.diff(q, axis=0)
    assert (np.sign(steps) * np.sign(state.qd) >= 0.0).all(), "no joint turns back"
    for joint in range(6):
        moves = np.flatnonzero(steps[:, joint])
        assert (moves == np.arange(len(moves))).all(), "what rests stays"
    assert way.duration < 2.0
    assert (way.next() == q[-1]).all()
    assert way.end == pytest.approx(q[-1])


def test_a_plant_that_fails_while_the_power_is_on_its_way_out_is_without_power():
    robot = moving()
    inject(robot, "emergency_stop")
    robot.tick()
    inject(robot, "nan")
    state = robot.tick(3)
    assert (state.robot_mode, state.safety_mode) == (RobotMode.POWER_OFF, SafetyMode.ROBOT_EMERGENCY_STOP)
    assert robot.send(c.UnlockProtectiveStop).code == "wrong_mode"
    assert robot.send(c.MoveJ, **MOVE).code == "wrong_mode"


def test_each_emergency_stop_is_released_by_itself():
    robot = Robot()
    inject(robot, "emergency_stop", seconds=0.02)
    inject(robot, "system_emergency_stop")
    assert robot.tick().safety_mode == SafetyMode.ROBOT_EMERGENCY_STOP
    assert robot.tick(20).safety_mode == SafetyMode.SYSTEM_EMERGENCY_STOP
    assert robot.send(c.PowerOn).code == "wrong_mode"


@pytest.mark.parametrize("fault", ["safeguard_stop", "emergency_stop", "reduced"])
def test_an_input_that_is_set_anew_does_not_end_by_what_it_was_set_to_before(fault):
    robot = Robot()
    inject(robot, fault, seconds=0.1)
    inject(robot, "normal")
    assert robot.tick().safety_mode == SafetyMode.NORMAL
    inject(robot, fault)
    mode = robot.tick().safety_mode
    assert mode != SafetyMode.NORMAL
    assert robot.tick(200).safety_mode == mode


def test_a_second_loss_of_power_while_the_brakes_work_says_how_long_they_still_do():
    robot = moving(500)
    inject(robot, "power_loss")
    robot.tick(5)
    inject(robot, "violation")
    robot.tick()
    first, second = told(robot, "safety_stop")
    assert second.duration == pytest.approx(first.duration - 5 * H, abs=3 * H)
    assert 0.0 < second.way < first.way

"""Stops of UR's categories 0, 1 and 2, and states that the safety system keeps."""

import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.instruments.variables import SAFETY_BITS
from tvist_controller.line.differentiator import Target
from tvist_controller.safety.safety_control import brake
from tvist_controller.setup import body, paper_payload
from tvist_protocol import commands as c
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationInject

from .robots import Q1, Q3, UR5E, H, Robot

MOVE = {"q": tuple(Q3)}


def inject(robot, fault, **fields):
    assert robot.send(SimulationInject, fault=fault, **fields) == Done()


def moving(ticks=300):
    robot = Robot()
    robot.move(ticks)
    return robot


def test_a_safeguard_stop_pauses_the_motion_until_its_release():
    robot = moving()
    inject(robot, "safeguard_stop")
    robot.tick(700)
    state = robot.states[-1]
    assert (state.safety_mode, state.runtime_state) == (SafetyMode.SAFEGUARD_STOP, RuntimeState.PAUSED)
    assert state.robot_mode == RobotMode.RUNNING
    assert [event.category for event in robot.told("safety_stop")] == [2]
    assert robot.send(c.Resume).code == "wrong_mode"
    assert robot.send(c.MoveJ, **MOVE).code == "busy"
    inject(robot, "normal")
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"
    assert robot.states[-1].safety_mode == SafetyMode.NORMAL
    assert robot.states[-1].target_q == pytest.approx(list(Q3), abs=1e-6)


@pytest.mark.parametrize("first", ["pause", "safeguard"])
def test_a_motion_paused_by_a_client_waits_for_resume(first):
    robot = moving()
    for what in ("pause", "safeguard") if first == "pause" else ("safeguard", "pause"):
        robot.send(c.Pause) if what == "pause" else inject(robot, "safeguard_stop")
    robot.tick(700)
    inject(robot, "normal")
    robot.tick(50)
    assert robot.states[-1].runtime_state == RuntimeState.PAUSED
    assert robot.send(c.Resume) == Done()
    robot.until_rest()
    assert robot.kinds()[-1] == "motion_done"


@pytest.mark.parametrize(
    ("fault", "mode"), [("emergency_stop", "ROBOT"), ("system_emergency_stop", "SYSTEM")]
)
def test_an_emergency_stop_stops_on_the_path_and_cuts_power_until_released(fault, mode):
    robot, mode = moving(), SafetyMode[f"{mode}_EMERGENCY_STOP"]
    inject(robot, fault)
    assert modes(robot.tick()) == (mode, RobotMode.RUNNING), "the drives still brake the arm"
    rested = robot.until_rest()
    assert modes(rested) == (mode, RobotMode.POWER_OFF)
    way = np.array(rested.target_q) - Q1
    assert np.abs(way - (way @ (Q3 - Q1)) / ((Q3 - Q1) @ (Q3 - Q1)) * (Q3 - Q1)).max() < 1e-9
    stop = robot.told("safety_stop")[0]
    assert stop.category == robot.told("motion_stopped")[0].category == 1
    assert stop.duration == pytest.approx((rested.tick - stop.tick) * H, abs=4 * H)
    refused = robot.send(c.PowerOn)
    assert (refused.code, "release the emergency stop" in refused.why) == ("wrong_mode", True)
    inject(robot, "normal")
    assert robot.tick().safety_mode == SafetyMode.NORMAL
    assert robot.send(c.PowerOn) == Done()
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)


def modes(state):
    return state.safety_mode, state.robot_mode


@pytest.mark.parametrize("fault", ["violation", "fault"])
def test_a_violation_or_fault_brakes_and_stays_until_safety_is_restarted(fault):
    robot, mode = moving(500), SafetyMode[fault.upper()]
    inject(robot, fault)
    assert modes(robot.tick()) == (mode, RobotMode.POWER_OFF)
    rested = robot.until_rest()
    assert rested.safety_mode == mode
    stop = robot.told("safety_stop")[0]
    assert stop.category == 0
    assert stop.duration == pytest.approx((rested.tick - stop.tick) * H, abs=4 * H)
    inject(robot, "normal")
    for command in (c.PowerOn, c.UnlockProtectiveStop, c.Resume):
        assert robot.send(command).code == "wrong_mode"
    assert "restart_safety" in robot.send(c.PowerOn).why
    assert robot.send(c.RestartSafety) == Done()
    assert modes(robot.tick()) == (SafetyMode.NORMAL, RobotMode.POWER_OFF)
    assert robot.send(c.PowerOn) == Done()
    assert isinstance(robot.send(c.MoveJ, **MOVE), Accepted)


def test_a_power_loss_brakes_without_a_safety_fault():
    robot = moving(500)
    inject(robot, "power_loss")
    assert modes(robot.until_rest()) == (SafetyMode.NORMAL, RobotMode.POWER_OFF)
    assert robot.send(c.PowerOn) == Done()


def test_safety_modes_have_their_rtde_bits():
    """RTDE's numbers: bit 5 system emergency stop, 6 robot, 7 either, 8 violation, 9 fault, 10 stopped by safety."""
    bits = {mode: {bit for bit in range(11) if SAFETY_BITS[mode] >> bit & 1} for mode in SAFETY_BITS}
    assert bits[SafetyMode.SAFEGUARD_STOP] == {4, 10}
    assert bits[SafetyMode.SYSTEM_EMERGENCY_STOP] == {5, 7, 10}
    assert bits[SafetyMode.ROBOT_EMERGENCY_STOP] == {6, 7, 10}
    assert bits[SafetyMode.VIOLATION] == {8, 10}
    assert bits[SafetyMode.FAULT] == {9, 10}


@pytest.mark.parametrize("seed", range(4))
def test_brakes_slow_every_joint_monotonically_to_rest(seed):
    """Brakes never speed a joint up, a joint that rests stays at rest, and all rest in the end."""
    random = np.random.default_rng(seed)
    state = Target(random.uniform(-3, 3, 6), random.uniform(-3, 3, 6), np.zeros(6))
    way = brake(UR5E, body(paper_payload(UR5E, float(random.uniform(0, 5)))), state)
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


@pytest.mark.parametrize("fault", ["safeguard_stop", "emergency_stop", "reduced"])
def test_a_safety_input_set_again_loses_its_earlier_end_time(robot, fault):
    inject(robot, fault, seconds=0.1)
    inject(robot, "normal")
    assert robot.tick().safety_mode == SafetyMode.NORMAL
    inject(robot, fault)
    mode = robot.tick().safety_mode
    assert mode != SafetyMode.NORMAL
    assert robot.tick(200).safety_mode == mode


def said(robot):
    return info_of(robot.controller)


REASONS = {
    "protective_stop": "injected",
    "safeguard_stop": "safeguard",
    "emergency_stop": "robot's emergency stop",
    "system_emergency_stop": "system's emergency stop",
    "violation": "violation",
    "fault": "failed",
    "power_loss": "loss of power",
}


@pytest.mark.parametrize("fault", REASONS)
def test_info_has_reason_and_tick_of_every_stop(fault):
    robot = moving(100)
    assert said(robot).stop is None
    inject(robot, fault)
    robot.tick(1000)
    assert REASONS[fault] in said(robot).stop.why
    assert said(robot).stop.tick == 101


def test_info_names_a_released_emergency_stop_while_power_is_off(robot):
    inject(robot, "emergency_stop")
    inject(robot, "normal")
    assert modes(robot.tick(10)) == (SafetyMode.NORMAL, RobotMode.POWER_OFF)
    assert "emergency stop" in said(robot).stop.why
    robot.send(c.PowerOn)
    assert said(robot).stop is None


def test_a_less_severe_stop_does_not_replace_the_reason(robot):
    inject(robot, "violation")
    for fault in ("safeguard_stop", "emergency_stop"):
        inject(robot, fault)
        robot.tick()
        assert "violation" in said(robot).stop.why
    inject(robot, "normal")
    inject(robot, "safeguard_stop")
    robot.send(c.RestartSafety)
    robot.tick()
    assert "safeguard" in said(robot).stop.why

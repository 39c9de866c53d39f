"""`info` says why a robot stands, for who comes after the event."""

import pytest

from tvist_controller.about import info_of
from tvist_protocol import commands as c
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q2, Robot


def inject(robot, fault, **fields):
    assert robot.send(SimulationInject, fault=fault, **fields) == Done()


def said(robot):
    return info_of(robot.controller)


@pytest.mark.parametrize("at", ["rest", "move"])
@pytest.mark.parametrize(
    ("fault", "mode", "words"),
    [
        ("protective_stop", SafetyMode.PROTECTIVE_STOP, "injected"),
        ("safeguard_stop", SafetyMode.SAFEGUARD_STOP, "safeguard"),
        ("emergency_stop", SafetyMode.ROBOT_EMERGENCY_STOP, "robot's emergency stop"),
        ("system_emergency_stop", SafetyMode.SYSTEM_EMERGENCY_STOP, "system's emergency stop"),
        ("violation", SafetyMode.VIOLATION, "violation"),
        ("fault", SafetyMode.FAULT, "failed"),
        ("power_loss", SafetyMode.NORMAL, "loss of power"),
    ],
)
def test_every_stop_has_its_reason_and_its_tick(fault, mode, words, at):
    robot = Robot()
    if at == "move":
        robot.send(c.MoveJ, q=tuple(Q2))
    robot.tick(100)
    assert said(robot).stop is None
    inject(robot, fault)
    robot.tick(1000)
    found = said(robot)
    assert found.safety_mode == mode
    assert words in found.stop.why
    assert found.stop.tick == 101


def test_a_drive_beyond_its_torque_is_a_reason_with_its_code():
    robot = Robot()
    inject(robot, "torque", joint=1, value=-1000.0, seconds=1.0)
    robot.tick(50)
    assert said(robot).stop.code == "limit_torque"


def test_a_stop_that_is_over_is_no_reason_any_more():
    robot = Robot()
    inject(robot, "protective_stop")
    robot.tick()
    robot.send(c.UnlockProtectiveStop)
    assert said(robot).stop is None
    robot.tick()
    robot.send(c.PowerOff)
    robot.tick()
    assert said(robot).robot_mode == RobotMode.POWER_OFF
    assert said(robot).stop is None


def test_an_emergency_stop_that_was_released_says_why_there_is_no_power():
    robot = Robot()
    inject(robot, "emergency_stop")
    inject(robot, "normal")
    robot.tick(10)
    found = said(robot)
    assert (found.robot_mode, found.safety_mode) == (RobotMode.POWER_OFF, SafetyMode.NORMAL)
    assert "emergency stop" in found.stop.why
    robot.send(c.PowerOn)
    assert said(robot).stop is None


def test_a_safeguard_during_a_protective_stop_is_the_reason_once_that_is_unlocked():
    robot = Robot()
    inject(robot, "protective_stop")
    inject(robot, "safeguard_stop")
    robot.tick()
    assert "injected" in said(robot).stop.why
    robot.send(c.UnlockProtectiveStop)
    robot.tick()
    assert "safeguard" in said(robot).stop.why


def test_what_comes_during_a_graver_stop_does_not_take_its_place():
    robot = Robot()
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


def test_a_protective_stop_made_again_under_a_safeguard_has_its_own_tick():
    robot = Robot()
    inject(robot, "safeguard_stop")
    for _ in range(2):
        inject(robot, "protective_stop")
        began = robot.tick().tick
        assert said(robot).stop.tick == began
        robot.send(c.UnlockProtectiveStop)
        robot.tick()


def test_modes_are_said_before_the_first_tick():
    found = said(Robot(mode="POWER_OFF"))
    assert (found.tick, found.robot_mode, found.safety_mode) == (0, RobotMode.POWER_OFF, SafetyMode.NORMAL)


def test_a_robot_that_was_put_into_a_mode_is_stopped_by_nothing_of_before():
    robot = Robot()
    robot.send(SimulationInject, fault="violation")
    robot.tick(5)
    assert info_of(robot.controller).stop is not None
    robot.send(SimulationReset, mode="RUNNING")
    robot.send(c.PowerOff)
    robot.tick(200)
    assert info_of(robot.controller).stop is None

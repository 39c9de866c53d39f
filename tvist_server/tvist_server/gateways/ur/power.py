"""Power, brakes and protective stops, as requested on the dashboard and the primary interface."""

from collections.abc import Callable

from tvist_protocol.commands import Command, PowerOff, PowerOn, RestartSafety, UnlockProtectiveStop
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.ur.base import ControllerAccess
from tvist_server.gateways.ur.robot import UrRobot

Outcome = Callable[[Refused | None], None]
"""Takes the refusal, or None if the robot is in the requested mode."""


def power_on(robot: UrRobot, control: ControllerAccess, outcome: Outcome) -> None:
    """Power on an arm that is off; its brakes stay closed."""
    there = (RobotMode.IDLE, RobotMode.BACKDRIVE, RobotMode.RUNNING)
    _change(
        control,
        lambda token: PowerOn(token=token, release_brakes=False),
        outcome,
        lambda: robot.latest is not None and robot.latest.robot_mode in there,
    )


def release_brakes(robot: UrRobot, control: ControllerAccess, outcome: Outcome) -> None:
    """Make the arm ready to move, from any mode."""
    _change(
        control,
        lambda token: PowerOn(token=token),
        outcome,
        lambda: robot.latest is not None and robot.latest.robot_mode == RobotMode.RUNNING,
    )


def power_off(control: ControllerAccess, outcome: Outcome) -> None:
    """Power off the arm once it stands still; this ends any program."""
    _change(control, lambda token: PowerOff(token=token), outcome, lambda: False)


def restart_safety(robot: UrRobot, control: ControllerAccess, outcome: Outcome) -> None:
    """Restart the safety system after a violation or a fault; otherwise power off the arm, as a restart does."""
    latest = robot.latest
    if latest is not None and latest.safety_mode in (SafetyMode.VIOLATION, SafetyMode.FAULT):
        _change(control, lambda token: RestartSafety(token=token), outcome, lambda: False)
    else:
        power_off(control, outcome)


def unlock(robot: UrRobot, control: ControllerAccess, outcome: Outcome) -> None:
    """Unlock a protective stop; without one, there is nothing to do."""
    _change(
        control,
        lambda token: UnlockProtectiveStop(token=token),
        outcome,
        lambda: robot.latest is not None and robot.latest.safety_mode != SafetyMode.PROTECTIVE_STOP,
    )


def _change(
    control: ControllerAccess, command: Callable[[str], Command], outcome: Outcome, there: Callable[[], bool]
) -> None:
    """Request a change; a refusal counts as success if the robot is already in the requested mode."""

    def then(reply: Reply) -> None:
        refused = reply if isinstance(reply, Refused) else None
        outcome(None if refused is not None and refused.code == "wrong_mode" and there() else refused)

    control.change(command, then)

"""Changes of power, brakes and protective stops; each function returns the refusal, or None for success."""

from collections.abc import Callable

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.commands import Command, PowerOff, PowerOn, RestartSafety, UnlockProtectiveStop
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Refused
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.robot import UrRobot

POWERED = (RobotMode.IDLE, RobotMode.BACKDRIVE, RobotMode.RUNNING)


async def power_on(robot: UrRobot, control: ConnectionControl) -> Refused | None:
    """Power on an arm that is off; its brakes stay closed."""
    return await _unless_there(
        robot,
        control,
        lambda token: PowerOn(token=token, release_brakes=False),
        lambda latest: latest.robot_mode in POWERED,
    )


async def release_brakes(robot: UrRobot, control: ConnectionControl) -> Refused | None:
    """Make the arm ready to move, from any mode."""
    return await _unless_there(
        robot,
        control,
        lambda token: PowerOn(token=token),
        lambda latest: latest.robot_mode == RobotMode.RUNNING,
    )


async def power_off(_robot: UrRobot, control: ConnectionControl) -> Refused | None:
    """Power off the arm once it is at rest; this ends any program."""
    reply = await control.change(lambda token: PowerOff(token=token))
    return reply if isinstance(reply, Refused) else None


async def restart_safety(robot: UrRobot, control: ConnectionControl) -> Refused | None:
    """Restart the safety system after a violation or a fault; otherwise power off the arm, as a restart does."""
    latest = robot.latest
    if latest is None or latest.safety_mode not in (SafetyMode.VIOLATION, SafetyMode.FAULT):
        return await power_off(robot, control)
    reply = await control.change(lambda token: RestartSafety(token=token))
    return reply if isinstance(reply, Refused) else None


async def unlock(robot: UrRobot, control: ConnectionControl) -> Refused | None:
    """Unlock a protective stop; do nothing if there is none."""
    return await _unless_there(
        robot,
        control,
        lambda token: UnlockProtectiveStop(token=token),
        lambda latest: latest.safety_mode != SafetyMode.PROTECTIVE_STOP,
    )


async def _unless_there(
    robot: UrRobot,
    control: ConnectionControl,
    command: Callable[[str], Command],
    there: Callable[[Snapshot], bool],
) -> Refused | None:
    """Request a change; a refusal counts as success if the robot is already in the requested mode."""
    reply = await control.change(command)
    if not isinstance(reply, Refused):
        return None
    latest = robot.latest
    return None if reply.code == "wrong_mode" and latest is not None and there(latest) else reply

"""Changes of power, brakes and protective stops; each returns the refusal, or None for success."""

from collections.abc import Awaitable, Callable

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.commands import PowerOff, PowerOn, RestartSafety, UnlockProtectiveStop
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Refused
from tvist_server.gateways.ur.lease import ConnectionControl, MakeCommand
from tvist_server.gateways.ur.robot import UrRobot

Change = Callable[[UrRobot, ConnectionControl], Awaitable[Refused | None]]


def _change(command: MakeCommand, there: Callable[[Snapshot], bool] = lambda _: False) -> Change:
    """Return a change. A refusal of `command` is success if the robot is `there`, in the wanted mode."""

    async def change(robot: UrRobot, control: ConnectionControl) -> Refused | None:
        reply, latest = await control.change(command), robot.latest
        if not isinstance(reply, Refused):
            return None
        return None if reply.code == "wrong_mode" and latest is not None and there(latest) else reply

    return change


power_on = _change(  # switches power on; the brakes stay closed
    lambda token: PowerOn(token=token, release_brakes=False),
    lambda latest: latest.robot_mode in (RobotMode.IDLE, RobotMode.BACKDRIVE, RobotMode.RUNNING),
)
release_brakes = _change(  # also switches power on if necessary
    lambda token: PowerOn(token=token), lambda latest: latest.robot_mode == RobotMode.RUNNING
)
power_off = _change(lambda token: PowerOff(token=token))  # stops the motion first; ends any program
unlock = _change(
    lambda token: UnlockProtectiveStop(token=token),
    lambda latest: latest.safety_mode != SafetyMode.PROTECTIVE_STOP,
)
_restart = _change(lambda token: RestartSafety(token=token))


def restart_safety(robot: UrRobot, control: ConnectionControl) -> Awaitable[Refused | None]:
    """After a violation or a fault, restart the safety system; in other modes, only power the arm off."""
    failed = robot.latest is not None and robot.latest.safety_mode in (SafetyMode.VIOLATION, SafetyMode.FAULT)
    return (_restart if failed else power_off)(robot, control)

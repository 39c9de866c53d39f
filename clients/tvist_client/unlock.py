"""Makes a robot that has stopped ready to move again, as far as a client can."""

import asyncio

import msgspec

from tvist_client.arm import UNLOCKED_TICKS, Arm
from tvist_client.errors import ClientError, ProtectiveStopError
from tvist_client.readiness import look, unlock_command
from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.certificates import Folder
from tvist_client.transports.zenoh import only_robot
from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode

CLIENT = "tvist unlock"  # name of the client that takes control
_WHAT_IT_FOUND: dict[str | None, str] = {
    SafetyMode.VIOLATION.name: "had found a violation",
    SafetyMode.FAULT.name: "had failed",
}
_ALLOW_POWER = {mode.name for mode in (SafetyMode.NORMAL, SafetyMode.REDUCED, SafetyMode.SAFEGUARD_STOP)}


class UnlockReport(msgspec.Struct, frozen=True):
    """What was done, and what remains to be done."""

    ok: bool  # whether the robot is ready to move now
    endpoint: str
    robot: str  # name of the robot
    done: list[str]
    """What was done, in order, such as "unlocked the protective stop"; empty if there was nothing to do."""
    robot_mode: str | None  # RTDE name of the robot mode afterwards
    safety_mode: str | None  # RTDE name of the safety mode afterwards
    stop: StopReason | None  # the stop that still, or again, keeps the robot from moving
    why: str  # what remains; empty if the robot is ready
    next: str  # the remedy; empty if the robot is ready


def unlock(
    endpoint: str = ENDPOINT,
    name: str | None = None,
    *,
    power_on: bool = False,
    security: Folder | None = None,
    namespace: str = "",
) -> UnlockReport:
    """Take control, release what a client can release, and check that the robot does not stop again.

    In lockstep, time advances by some hundred ticks. Without a name, it is the only robot at the endpoint, or `ur5e`.
    """
    return asyncio.run(_unlock(endpoint, name, security, namespace, power_on=power_on))


async def make_ready(robot: Robot, arm: Arm, *, power_on: bool = False) -> list[str]:
    """Restart the safety system, unlock a protective stop and power on the arm if needed; return what was done."""
    done: list[str] = []
    found = await look(robot)
    if found.safety_mode in _WHAT_IT_FOUND:
        await arm.restart_safety()
        done.append(f"restarted the safety system, which {_WHAT_IT_FOUND[found.safety_mode]}")
        found = await look(robot)
    if found.safety_mode == SafetyMode.PROTECTIVE_STOP.name:
        await _rest(robot)
        done.append("unlocked the protective stop")
        try:
            await arm.unlock_protective_stop()
            if await robot.clock() != "realtime":
                await robot.advance(UNLOCKED_TICKS)
        except ProtectiveStopError:
            pass  # the caller checks the result
        found = await look(robot)
        if found.safety_mode == SafetyMode.PROTECTIVE_STOP.name:
            done.append("the robot stopped again at once")
    if power_on and found.safety_mode in _ALLOW_POWER and found.robot_mode != RobotMode.RUNNING.name:
        await _rest(robot)
        await arm.power_on()
        done.append("switched the power on and released the brakes")
        await robot.advance(UNLOCKED_TICKS)
    return done


async def _rest(robot: Robot) -> None:
    """Wait until a stop has come to rest; before the first tick nothing moves."""
    ticks = await robot.clock() == "realtime" or (await robot.info()).tick > 0
    if ticks and (await robot.state()).runtime_state == RuntimeState.STOPPING:
        await robot.rest()


async def _unlock(
    endpoint: str, name: str | None, security: Folder | None, namespace: str, *, power_on: bool
) -> UnlockReport:
    name = name or await only_robot(endpoint, NAME, security, namespace)
    command = unlock_command(endpoint, name, security, namespace)
    async with await Robot.connect(endpoint, name, security=security, namespace=namespace) as robot:
        if (await robot.info()).watched is not None:
            raise ClientError(
                f"{name} is only watched: unlock it at the robot, since nothing is sent to it from here"
            )
        found, done = await look(robot, command), list[str]()
        if not found.ready:
            async with robot.control(CLIENT) as arm:
                done = await make_ready(robot, arm, power_on=power_on)
            found = await look(robot, command)
    return UnlockReport(
        ok=found.ready,
        endpoint=endpoint,
        robot=name,
        done=done,
        robot_mode=found.robot_mode,
        safety_mode=found.safety_mode,
        stop=found.stop,
        why=found.why,
        next=found.next,
    )

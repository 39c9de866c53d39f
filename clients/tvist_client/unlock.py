"""Makes a robot that has stopped ready to move again, as far as a client can."""

from contextlib import suppress

import msgspec

from tvist_client.arm import UNLOCKED_TICKS, Arm
from tvist_client.errors import ClientError, ProtectiveStopError
from tvist_client.readiness import look
from tvist_client.robot import Robot
from tvist_protocol import RobotMode, RuntimeState, SafetyMode, StopReason

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


async def unlock(robot: Robot, endpoint: str, command: str, *, power_on: bool = False) -> UnlockReport:
    """Take control, end the stops that a client can end, and check that the robot does not stop again.

    In lockstep, this steps some hundred ticks. `endpoint` and the command line `command` are for the report.
    """
    info, found, done = await robot.info(), await look(robot, command), list[str]()
    if info.watched is not None:
        raise ClientError(
            f"{info.name} is only watched, and nothing is sent to it from here: unlock it at the robot"
        )
    if not found.ready:
        async with robot.control(CLIENT) as arm:
            done = await make_ready(robot, arm, power_on=power_on)
        found = await look(robot, command)
    return UnlockReport(
        ok=found.ready,
        endpoint=endpoint,
        robot=info.name,
        done=done,
        robot_mode=found.robot_mode,
        safety_mode=found.safety_mode,
        stop=found.stop,
        why=found.why,
        next=found.next,
    )


async def make_ready(robot: Robot, arm: Arm, *, power_on: bool = False) -> list[str]:
    """Restart the safety system, unlock a protective stop and power on the arm if needed; return what was done."""
    done, found = list[str](), await look(robot)
    if found.safety_mode in _WHAT_IT_FOUND:
        await arm.restart_safety()
        done.append(f"restarted the safety system, which {_WHAT_IT_FOUND[found.safety_mode]}")
        found = await look(robot)
    if found.safety_mode == SafetyMode.PROTECTIVE_STOP.name:
        await _rest(robot)
        done.append("unlocked the protective stop")
        with suppress(ProtectiveStopError):  # the caller checks the result
            await arm.unlock_protective_stop()
            if await robot.clock() != "realtime":
                await robot.advance(UNLOCKED_TICKS)
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
    """Wait until the arm is at rest after a stop. Before the first tick, nothing moves."""
    ticks = await robot.clock() == "realtime" or (await robot.info()).tick > 0
    if ticks and (await robot.state()).runtime_state == RuntimeState.STOPPING:
        await robot.rest()

"""`tvist move`: move a served robot to a pose."""

import asyncio
import math
from collections.abc import Mapping
from typing import Annotated, Any

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, Misuse, interrupted
from tvist_cli.offered import POSES, SHAPERS
from tvist_cli.output import print_lines, program
from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_client.readiness import look
from tvist_protocol.errors import RefusedError, quoted

BENT = "0,-1.57,1.57,-1.57,-1.57,0"  # joint angles of UR-like arms that are far from any singularity [rad]


def move(
    target: Annotated[str, POSES],
    *,
    line: bool = False,
    by: bool = False,
    at: Connection = LOCAL,
    degrees: bool = False,
    velocity: float | None = None,
    acceleration: float | None = None,
    jerk: float | None = None,
    duration: float | None = None,
    shaper: Annotated[str | None, SHAPERS] = None,
    json: bool = False,
) -> None:
    """Move a served robot to a pose and print how long it took; Control+C stops the motion.

    Args:
        target: Move to this pose: a name from the robot file that begins with a letter, such as Q1, or joint
            angles in rad separated by commas: -0.5,-3.1,0,-1.57,0,0. With --line, give the tool's position
            x,y,z in m in the base frame, or position and rotation vector x,y,z,rx,ry,rz in m and rad; with
            three numbers the tool keeps its orientation.
        line: Move the tool on a straight line to the target.
        by: Read the target of --line as a displacement dx,dy,dz in m in the base frame: --line --by 0,0,-0.1
            moves the tool 0.1 m down.
        at: Where the robot is.
        degrees: Read the target's angles in degrees; the limits stay in rad.
        velocity: Limit the velocity of every joint in rad/s [1.5], or of the tool in m/s with --line [0.25].
        acceleration: Limit the acceleration of every joint in rad/s² [2], or of the tool in m/s² with --line [1.2].
        jerk: Limit the jerk of every joint in rad/s³ [100], or of the tool in m/s³ with --line [60].
        duration: Make the motion take this time in s before shaping, instead of setting the three limits; it
            takes longer if the arm cannot do that.
        shaper: Select this shaper before the motion.
        json: Print one JSON object.
    """
    limits = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk, "duration": duration}
    given: dict[str, Any] = {name: value for name, value in limits.items() if value is not None}
    if "duration" in given and len(given) > 1:
        raise Misuse(f"--{next(iter(given))} and --duration exclude each other: give one of them")
    numbers = _checked(target, line=line, by=by, degrees=degrees)
    held = False

    async def run() -> tuple[int, int, str | None]:
        nonlocal held
        async with await at.robot() as robot:
            info = await robot.info()
            q = () if line else _pose(target, info.poses, degrees=degrees)
            standing = await look(robot, at.unlock_command(info.name))
            if not standing.ready:
                raise Failure(f"{info.name} is not ready: {standing.sentence}")
            async with robot.control("tvist move") as arm:
                if shaper is not None:
                    await arm.set_shaper(shaper.lower())
                held = True
                try:
                    if line:
                        motion = await _line(arm, numbers, given, by=by, joints=len(info.joints))
                    else:
                        motion = await arm.move_j(q, **given)
                except (
                    asyncio.CancelledError
                ):  # bring it to rest, even if the motion has not been answered yet
                    await arm.stop()
                    await robot.rest()
                    raise
                return motion.started or 0, motion.done or 0, motion.limited

    try:
        started, done, limited = asyncio.run(run())
    except KeyboardInterrupt:
        ended = "the motion was stopped; the robot is at rest" if held else "nothing was moved"
        raise interrupted(ended) from None
    seconds = (done - started) * 0.002
    moved = f"moved the tool {'by' if by else 'to'}" if line else "moved to"
    lines = [f"{moved} {target.strip()} in {seconds:.3f} s", *filter(None, [limited])]
    result = {"started_tick": started, "done_tick": done, "seconds": seconds, "limited": limited}
    print_lines(result, lines, json=json)


def _checked(target: str, *, line: bool, by: bool, degrees: bool) -> tuple[float, ...]:
    """Check the target before the robot is contacted; return its numbers if `line`, else no numbers."""
    if line:
        return _tool_numbers(target, by=by, degrees=degrees)
    if by:
        raise Misuse("--by needs --line: only the tool is moved by a distance")
    if "," in target or not target.strip()[:1].isalpha():
        _pose(target, {}, degrees=degrees)
    return ()


def _pose(text: str, poses: Mapping[str, tuple[float, ...]], *, degrees: bool) -> tuple[float, ...]:
    """Return joint angles [rad], given by a pose's name in upper or lower case, or as numbers with commas."""
    for name, q in poses.items():
        if name.lower() == text.strip().lower():
            return q
    angles = _numbers(text)
    if not angles:
        unit = "degrees" if degrees else "rad"
        known = f"one of {', '.join(poses)}, or " if poses else ""
        raise Misuse(f"target is {quoted(text)}: must be {known}joint angles in {unit} separated by commas")
    return tuple(map(math.radians, angles)) if degrees else angles


def _tool_numbers(text: str, *, by: bool, degrees: bool) -> tuple[float, ...]:
    """Parse a tool target: displacement (`by`) or position [m], or position and rotation vector [rad]."""
    numbers = _numbers(text)
    if len(numbers) not in ({3} if by else {3, 6}):
        pose = f"a position x,y,z in m, or x,y,z,rx,ry,rz in m and {'degrees' if degrees else 'rad'}"
        wanted = "a distance dx,dy,dz in m" if by else pose
        raise Misuse(f"target is {quoted(text)}: must be {wanted}")
    turn = tuple(map(math.radians, numbers[3:])) if degrees else numbers[3:]
    return numbers[:3] + turn


def _numbers(text: str) -> tuple[float, ...]:
    """Parse numbers separated by commas; return no numbers if the text is anything else."""
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()


async def _line(
    arm: Arm, numbers: tuple[float, ...], limits: dict[str, Any], *, by: bool, joints: int
) -> Motion:
    """Move the tool to a position or by a displacement; with three numbers it keeps its orientation."""
    if len(numbers) == 3:
        x, y, z, *turn = await arm.robot.forward_kinematics()
        at = [x + numbers[0], y + numbers[1], z + numbers[2]] if by else numbers
        numbers = (*at, *turn)
    try:
        return await arm.move_l(numbers, **limits)
    except RefusedError as error:
        if error.reply.code != "singular":
            raise
        example = f", for example with {program()} move {BENT}" if joints == 6 else ""
        raise Failure(f"{error}. Next: move the joints to another posture first{example}") from error

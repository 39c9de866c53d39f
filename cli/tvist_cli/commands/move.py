"""`tvist move`: move a served robot to one pose."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import out, print_json
from tvist_cli.poses import pose

if TYPE_CHECKING:
    from tvist_client.arm import Arm


def move(
    target: str,
    *,
    endpoint: str = "tcp/127.0.0.1:7447",
    name: str | None = None,
    security: Path | None = None,
    degrees: bool = False,
    velocity: float = 1.5,
    acceleration: float = 2.0,
    jerk: float = 100.0,
    shaper: str | None = None,
    json: bool = False,
) -> None:
    """Move a served robot to a pose and print how long it took; Control+C stops the motion.

    Args:
        target: Name of a pose in the robot file that begins with a letter, such as Q1, or joint angles in rad separated
            by commas: -0.5,-3.1,0,-1.57,0,0.
        endpoint: Zenoh endpoint of the robot.
        name: Name of the robot [ur5e; if there is none, the only robot at the endpoint].
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        degrees: Read the target's angles in degrees; the limits stay in rad.
        velocity: Velocity limit of every joint in rad/s.
        acceleration: Acceleration limit of every joint in rad/s².
        jerk: Jerk limit of every joint in rad/s³.
        shaper: Shaper to select before the motion.
        json: Print one JSON object.
    """
    from tvist_client.readiness import look, unlock_command
    from tvist_client.robot import NAME, Robot
    from tvist_client.transports.zenoh import only_robot

    if "," in target or not target.strip()[:1].isalpha():
        # A name begins with a letter; angles are checked before the robot is asked for anything.
        pose(target, {}, "target", degrees=degrees)
    held = False

    async def run() -> tuple[int, int]:
        nonlocal held
        found = name if name is not None else await only_robot(endpoint, NAME, security)
        async with await Robot.connect(endpoint, found, security=security) as robot:
            q = pose(target, (await robot.info()).poses, "target", degrees=degrees)
            standing = await look(robot, unlock_command(endpoint, found, security))
            if not standing.ready:
                raise Failure(f"{found} is not ready: {standing.sentence}")
            async with robot.control("tvist move") as arm:
                if shaper is not None:
                    await arm.set_shaper(shaper.lower())
                held = True
                try:
                    motion = await arm.move_j(q, velocity=velocity, acceleration=acceleration, jerk=jerk)
                except asyncio.CancelledError:
                    await _stop(arm)
                    raise
                return motion.started or 0, motion.done or 0

    with told():
        try:
            started, done = asyncio.run(run())
        except KeyboardInterrupt:
            ended = "the motion was stopped; the robot is at rest" if held else "nothing was moved"
            raise interrupted(ended) from None
    if json:
        print_json({"started_tick": started, "done_tick": done, "seconds": (done - started) * 0.002})
    else:
        out.print(f"moved to {target.strip()} in {(done - started) * 0.002:.3f} s", markup=False)


async def _stop(arm: "Arm") -> None:
    """Bring the robot to rest, whether or not the motion has been answered."""
    await arm.stop()
    await arm.robot.rest()

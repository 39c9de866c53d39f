"""`tvist move`: one motion by hand."""

import asyncio
from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json


def move(
    target: str,
    *,
    endpoint: str = "tcp/127.0.0.1:7447",
    name: str = "ur5e",
    security: Path | None = None,
    velocity: float = 1.5,
    acceleration: float = 2.0,
    jerk: float = 100.0,
    shaper: str | None = None,
    json: bool = False,
) -> None:
    """Move a served robot to a pose and say how long it took.

    Args:
        target: Q1, Q2, Q3, or joint angles in rad with commas.
        endpoint: Zenoh endpoint of the robot.
        name: Its name.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        velocity: Limit for every joint in rad/s.
        acceleration: Limit for every joint in rad/s².
        jerk: Limit for every joint in rad/s³.
        shaper: Shaper to choose first.
        json: Print one JSON object.
    """
    from tvist_client.readiness import look, unlock_command
    from tvist_client.robot import Robot
    from tvist_lab.paper.published import published

    poses = {key: tuple(value["q"]) for key, value in published()["configurations"].items()}
    try:
        q = poses[target] if target in poses else tuple(float(angle) for angle in target.split(","))
    except ValueError:
        known = ", ".join(poses)
        raise Failure(
            f"target is {target!r}: must be one of {known}, or joint angles with commas", code=2
        ) from None

    async def run() -> tuple[int, int]:
        async with await Robot.connect(endpoint, name, security=security) as robot:
            found = await look(robot, unlock_command(endpoint, name, security))
            if not found.ready:
                raise Failure(f"{name} is not ready: {found.sentence}")
            async with robot.control("tvist move") as arm:
                if shaper is not None:
                    await arm.set_shaper(shaper)
                motion = await arm.move_j(q, velocity=velocity, acceleration=acceleration, jerk=jerk)
                return motion.started or 0, motion.done or 0

    with told():
        started, done = asyncio.run(run())
    if json:
        print_json({"started_tick": started, "done_tick": done, "seconds": (done - started) * 0.002})
    else:
        out.print(f"moved to {target} in {(done - started) * 0.002:.3f} s")

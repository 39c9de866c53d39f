"""A robot in this process, as fast as it computes, with the same client as a robot on the network.

Several that make the same motions with several shapers are comparable tick by tick.
"""

import math
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from itertools import pairwise

from msgspec.structs import replace

from tvist_client.robot import Robot
from tvist_client.transports.loopback import LoopbackTransport
from tvist_controller.api.line import Setup
from tvist_controller.api.robot import LoopbackHost
from tvist_lab.collect import Collected, collect
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Info
from tvist_server.config import ServeConfig

LEAD = 150
"""Ticks at rest before the first motion."""
VELOCITY, ACCELERATION = 1.5, 2.0
"""Limits of the motions: the paper's [rad/s, rad/s²]."""
REST_S = 1.0
"""Time for the shaper's delay and the vibration after a motion [s]."""


def free_setup(config: ServeConfig | None = None, **changes: object) -> Setup:
    """Return a setup with a free clock and published truth, by default of the default robot.

    Args:
        config: Configuration to start from, with its own truth; since nothing in this process follows the wall clock,
            `realtime` becomes `free`.
        changes: Fields of `ServeConfig` to change.

    Raises:
        StartError: A change names no field, or has an invalid value.
    """
    from tvist_server.config import from_mapping

    if config is None:
        return from_mapping({"clock": "free", "truth": True, **changes}, "setup").setup()
    checked = from_mapping(changes, "setup")
    timeless: dict[str, object] = {"clock": "free"} if config.clock == "realtime" else {}
    return replace(config, **(timeless | {name: getattr(checked, name) for name in changes})).setup()


@asynccontextmanager
async def robot_in_process(setup: Setup) -> AsyncIterator[Robot]:
    """Run a robot in this process, and yield a client of it."""
    async with Robot.over(LoopbackTransport(LoopbackHost(setup))) as robot:
        yield robot


async def run_beside(
    shaper: str,
    poses: Sequence[Sequence[float]],
    *,
    robot: str = "ur5e",
    seed: int = 0,
) -> tuple[Info, Collected]:
    """Move one arm through poses with a shaper; every motion begins at the same tick whatever the shaper.

    Args:
        shaper: Name of the shaper.
        poses: Joint angles, the first of which it starts at [rad].
        robot: Robot that comes with the package, or path of a robot file.
        seed: Seed of sensor noise and gear errors.

    Returns:
        The robot, and everything it published.
    """
    setup = free_setup(robot=robot, shaper=shaper, seed=seed)
    async with robot_in_process(setup) as client, client.control("compare") as arm:
        await arm.reset(q=poses[0])
        with collect(client) as collected:
            begun = await client.advance(LEAD)
            for start, end in pairwise(poses):
                await arm.move_j(end, velocity=VELOCITY, acceleration=ACCELERATION)
                begun += _ticks(start, end)
                await client.advance(begun - (await client.state()).tick)
        return await client.info(), collected


def _ticks(start: Sequence[float], end: Sequence[float]) -> int:
    """Ticks from the beginning of a motion to that of the next, whatever the shaper."""
    way = max(abs(a - b) for a, b in zip(start, end, strict=True))
    return math.ceil((way / VELOCITY + VELOCITY / ACCELERATION + REST_S) / PERIOD)

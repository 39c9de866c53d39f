"""Run a robot in this process as fast as it computes, with the usual client."""

import math
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from itertools import pairwise

from tvist_client.robot import Robot
from tvist_client.transports.loopback import LoopbackTransport
from tvist_controller.api.line import Setup
from tvist_controller.api.robot import LoopbackHost
from tvist_lab.collect import Collected, collect
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Info
from tvist_server.config import from_mapping

LEAD = 150  # ticks at rest before the first motion
VELOCITY, ACCELERATION = 1.5, 2.0  # the paper's limits of the motions [rad/s, rad/s²]
REST_S = 1.0  # time for the shaper's delay and the vibration after a motion [s]


def free_setup(**changes: object) -> Setup:
    """Return a setup with a free clock and published truth, by default of the default robot.

    `changes` are fields of `ServeConfig`. Raises StartError if a change names no field or has an invalid value.
    """
    return from_mapping({"clock": "free", "truth": True, **changes}, "setup").setup()


@asynccontextmanager
async def robot_in_process(setup: Setup) -> AsyncIterator[Robot]:
    """Run a robot in this process; yield its client."""
    async with Robot.over(LoopbackTransport(LoopbackHost(setup))) as robot:
        yield robot


async def run_beside(
    shaper: str, poses: Sequence[Sequence[float]], robot: str = "ur5e"
) -> tuple[Info, Collected]:
    """Move one arm through poses [rad] with a shaper; return the robot's info and all its messages.

    Every motion starts at the same tick with any shaper. `robot` is a name or the path of a robot file.
    """
    setup = free_setup(robot=robot, shaper=shaper)
    async with robot_in_process(setup) as client, client.control("compare") as arm:
        await arm.reset(q=poses[0])
        with collect(client) as collected:
            begun = await client.advance(LEAD)
            for start, end in pairwise(poses):
                await arm.move_j(end, velocity=VELOCITY, acceleration=ACCELERATION)
                # A motion and the rest after it take equally long with all shapers.
                way = max(abs(a - b) for a, b in zip(start, end, strict=True))
                begun += math.ceil((way / VELOCITY + VELOCITY / ACCELERATION + REST_S) / PERIOD)
                await client.advance(begun - (await client.state()).tick)
        return await client.info(), collected

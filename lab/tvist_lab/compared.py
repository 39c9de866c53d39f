"""The same motions by several shapers, each on an arm of its own, tick by tick comparable."""

import math
from collections.abc import Sequence
from itertools import pairwise

from tvist_lab.collect import Collected, collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.plant import PERIOD
from tvist_protocol.info import Info

LEAD = 150
"""Ticks at rest before the first motion."""
VELOCITY, ACCELERATION = 1.5, 2.0
"""Limits of the motions: the paper's [rad/s, rad/s²]."""
REST_S = 1.0
"""Time for the shaper's delay and the vibration after a motion [s]."""


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

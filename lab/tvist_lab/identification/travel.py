"""Move a robot to the place of a measurement without a collision."""

from collections.abc import Awaitable
from typing import TypeVar

import numpy as np

from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_lab.recordings import Floats
from tvist_protocol.errors import RefusedError

Result = TypeVar("Result")


async def unless_collision(measuring: Awaitable[Result]) -> Result | None:
    """Await a motion or measurement; return None if the robot refuses it because of a collision."""
    try:
        return await measuring
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None


async def reach(arm: Arm, q: Floats) -> Motion:
    """Move to a configuration; if the straight line collides, move via the upright arm.

    Raises RefusedError with code `collision` if the way via the upright arm collides, too.
    """
    if (there := await unless_collision(arm.move_j(q))) is not None:
        return there
    upright = np.zeros_like(q)
    upright[[joint for joint in (1, 3) if joint < len(q)]] = -np.pi / 2
    await arm.move_j(upright)
    return await arm.move_j(q)

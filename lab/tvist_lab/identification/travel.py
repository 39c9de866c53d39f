"""Move a robot to the place of a measurement, without a collision and within the torque limits."""

from collections.abc import Awaitable
from dataclasses import asdict
from typing import TypeVar

import numpy as np

from tvist_client.arm import Arm
from tvist_client.motion import Motion
from tvist_client.robot import Robot
from tvist_controller.api.line import (
    REBOUND,
    InverseDynamics,
    JointLine,
    MotionLimits,
    acceleration_on_way,
    body,
)
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_protocol.errors import RefusedError
from tvist_protocol.values import Payload

WAYS = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""Limits of the ways to measurements where the torques permit them."""
SLOWEST = 0.1  # smallest speed of a way relative to that with its limits [-]

Result = TypeVar("Result")


class Travel:
    """Moves a robot so slowly that its vibrating arm with a payload keeps the torque limits."""

    def __init__(self, robot: Robot, arm: Arm, description: RobotDescription, payload: Payload) -> None:
        self._robot, self._arm, self._torque = robot, arm, np.array(description.limits.torque)
        self._dynamics = InverseDynamics(description, body(payload))

    async def move(self, q: Floats, limits: MotionLimits = WAYS) -> Motion:
        """Move to a configuration on a straight line in joint space."""
        here = np.array((await self._robot.state()).target_q)
        share = max(quickness(self._dynamics, here, q, limits, self._torque), SLOWEST)
        return await self._arm.move_j(q, **asdict(slower(limits, share)))

    async def reach(self, q: Floats) -> Motion:
        """Move to a configuration; if the straight line collides, move via the upright arm.

        Raises RefusedError with code `collision` if the way via the upright arm collides, too.
        """
        if (there := await unless_collision(self.move(q))) is not None:
            return there
        upright = np.zeros_like(q)
        upright[[joint for joint in (1, 3) if joint < len(q)]] = -np.pi / 2
        await self.move(upright)
        return await self.move(q)


def quickness(
    dynamics: InverseDynamics, start: Floats, end: Floats, limits: MotionLimits, torque: Floats
) -> float:
    """Return the largest `quickness` of `slower`, up to 1, with which a vibrating arm keeps torque limits."""
    room = acceleration_on_way(dynamics, JointLine(start, end), start, end - start, limits.velocity, torque)
    return min(1.0, float(np.sqrt(room / (1.0 + REBOUND) / limits.acceleration)))


def slower(limits: MotionLimits, quickness: float) -> MotionLimits:
    """Return the limits with which a motion takes 1 / quickness times as long."""
    return MotionLimits(
        quickness * limits.velocity, quickness**2 * limits.acceleration, quickness**3 * limits.jerk
    )


async def unless_collision(measuring: Awaitable[Result]) -> Result | None:
    """Await a motion or measurement; return None if the robot refuses it because of a collision."""
    try:
        return await measuring
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None

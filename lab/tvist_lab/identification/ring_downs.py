"""Make the arm ring at a configuration and listen."""

from dataclasses import dataclass

import numpy as np

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.metrics import RingDown, fit_ring_down, motions, tool_acceleration
from tvist_lab.recordings import Floats
from tvist_protocol.errors import RefusedError

LISTEN = 0.6
"""Time the arm is listened to after a jog [s]."""
PAUSE = 0.3
"""Time it rests before the next [s]."""
MODES = 2
"""Modes that are fitted together."""
SHARE = 0.25
"""The lowest mode that rings at least this loud beside the loudest is the first one [-]."""


@dataclass(frozen=True)
class Jog:
    """A short move that ends where the arm is to ring, with all big joints at once: it stirs every mode there is."""

    length: float = 0.06
    """Of the fastest joint [rad]."""
    shares: tuple[float, ...] = (0.6, 0.6, 1.0)
    """Of the joints from the base on [-]."""

    def of(self, joints: int) -> Floats:
        """Joint displacement, shape (joints,) [rad]."""
        jog = np.zeros(joints)
        used = min(joints, len(self.shares))
        jog[:used] = self.length * np.array(self.shares[:used])
        return jog


async def reach(arm: Arm, q: Floats) -> None:
    """Move to a configuration; where something would meet on the straight way, by the upright arm.

    Raises:
        RefusedError: It cannot be reached that way either; code `collision`.
    """
    try:
        await arm.move_j(q)
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        upright = np.zeros_like(q)
        upright[[joint for joint in (1, 3) if joint < len(q)]] = -np.pi / 2
        await arm.move_j(upright)
        await arm.move_j(q)


async def measure(robot: Robot, arm: Arm, q: Floats, jog: Jog, repeats: int) -> RingDown:
    """(f_d, ζ) of the mode that rings most after a jog to a configuration.

    Equal jogs ring alike, so their accelerations are averaged before the fit.

    Args:
        robot: The robot.
        arm: Control of it; its shaper must be `none`.
        q: Configuration, shape (n,) [rad].
        jog: The move that makes it ring.
        repeats: Jogs to average.

    Raises:
        RefusedError: The configuration cannot be reached; code `collision`.
    """
    start = q - jog.of(len(q))
    await reach(arm, start)
    period = 1.0 / (await robot.info()).rate_hz
    rings = []
    for _ in range(repeats):
        await arm.move_j(start)
        await robot.advance(round(PAUSE / period))
        with collect(robot) as collected:
            await robot.advance(1)
            await arm.move_j(q)
            await robot.advance(round(LISTEN / period))
        recording = collected.recording()
        stop = motions(recording)[0].shaped_stop
        rings.append(tool_acceleration(recording)[stop : stop + round(LISTEN / period)])
    length = min(map(len, rings))
    return fit_ring_down(np.mean([ring[:length] for ring in rings], axis=0), period, modes=MODES, share=SHARE)

"""Detection of limits given in degrees instead of radians, which would be no limits at all."""

import math
from collections.abc import Sequence
from typing import Final

from tvist_plant.user_file import UserFileError

MAX_POSITION: Final = 20.0 * math.pi
"""Largest position limit that is accepted as radians: ten turns in either direction [rad]."""
MAX_VELOCITY: Final = 16.0 * math.pi
"""Largest velocity limit that is accepted as radians: eight turns per second [rad/s]."""


def check_limits(position: Sequence[float], velocity: Sequence[float], source: str) -> None:
    """Refuse limits that only make sense in degrees.

    Args:
        position: Position limits in either direction, one per joint [rad].
        velocity: Velocity limits, one per joint [rad/s].
        source: File that contains them, for the message.

    Raises:
        UserFileError: A limit exceeds `MAX_POSITION` or `MAX_VELOCITY`; the message gives it in both units.
    """
    for key, values, most, per in (
        ("position", position, MAX_POSITION, ""),
        ("velocity", velocity, MAX_VELOCITY, "/s"),
    ):
        for joint, value in enumerate(values):
            if value > most:
                raise UserFileError(
                    f"{source}: limits.{key}[{joint}] is {value:g} rad{per}, and at most {most:.1f} rad{per} are "
                    f"supported: if degrees were meant, write {math.radians(value):.6g} rad{per}"
                )

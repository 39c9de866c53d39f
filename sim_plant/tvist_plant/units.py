"""Limits in radians, told from limits in degrees: an arm that believed the latter would have none."""

import math
from collections.abc import Sequence
from typing import Final

from tvist_plant.user_file import UserFileError

MAX_POSITION: Final = 20.0 * math.pi
"""Largest limit of a position that is taken for radians: ten turns either way [rad]."""
MAX_VELOCITY: Final = 16.0 * math.pi
"""Largest limit of a velocity that is taken for radians: eight turns a second [rad/s]."""


def check_limits(position: Sequence[float], velocity: Sequence[float], source: str) -> None:
    """Refuse limits that only degrees make sense of.

    Args:
        position: One a joint, either way from zero [rad].
        velocity: One a joint [rad/s].
        source: File that contains them, for the message.

    Raises:
        UserFileError: One exceeds `MAX_POSITION` or `MAX_VELOCITY`; the message gives it in both units.
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

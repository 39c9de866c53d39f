"""Poses as users type them: a name in any case, or angles."""

import math
from collections.abc import Mapping

from tvist_cli.failure import Failure
from tvist_protocol.errors import quoted


def pose(
    text: str, poses: Mapping[str, tuple[float, ...]], what: str, *, degrees: bool = False
) -> tuple[float, ...]:
    """Return the joint angles [rad] that a text describes.

    Args:
        text: Name of a pose in any case, or angles separated by commas.
        poses: Named poses [rad].
        what: Name of the argument, for the message.
        degrees: Whether the angles are in degrees.

    Raises:
        Failure: The text is neither.
    """
    for name, q in poses.items():
        if name.lower() == text.strip().lower():
            return q
    try:
        angles = tuple(float(angle) for angle in text.split(","))
    except ValueError:
        angles = ()
    if not angles or not all(map(math.isfinite, angles)):
        unit = "degrees" if degrees else "rad"
        known = f"one of {', '.join(poses)}, or " if poses else ""
        why = f"{what} is {quoted(text)}: must be {known}joint angles in {unit} separated by commas"
        raise Failure(why, code=2)
    return tuple(map(math.radians, angles)) if degrees else angles

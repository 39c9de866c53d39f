"""Poses as a person types them: a name in any case, or angles."""

import math
from collections.abc import Mapping

from tvist_cli.failure import Failure
from tvist_protocol.errors import quoted


def pose(
    text: str, poses: Mapping[str, tuple[float, ...]], what: str, *, degrees: bool = False
) -> tuple[float, ...]:
    """Joint angles [rad] that a text stands for.

    Args:
        text: Name of a pose in any case, or angles with commas.
        poses: Those with a name [rad].
        what: Name of the argument, for the sentence.
        degrees: Whether the angles are in degrees.

    Raises:
        Failure: It is neither.
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
        why = f"{what} is {quoted(text)}: must be one of {', '.join(poses)}, or joint angles in {unit} with commas"
        raise Failure(why, code=2)
    return tuple(map(math.radians, angles)) if degrees else angles

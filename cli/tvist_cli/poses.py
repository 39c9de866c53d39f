"""Poses as users type them: a name in any case, angles, or the place of the tool."""

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
    """
    for name, q in poses.items():
        if name.lower() == text.strip().lower():
            return q
    angles = _numbers(text)
    if not angles:
        unit = "degrees" if degrees else "rad"
        known = f"one of {', '.join(poses)}, or " if poses else ""
        why = f"{what} is {quoted(text)}: must be {known}joint angles in {unit} separated by commas"
        raise Failure(why, code=2)
    return tuple(map(math.radians, angles)) if degrees else angles


def tool_numbers(text: str, *, by: bool, degrees: bool = False) -> tuple[float, ...]:
    """Return the numbers of a target of the tool: a distance or position [m], or a position and rotation vector [rad].

    Args:
        text: Three numbers separated by commas, or six if it is not a distance.
        by: Whether it is a distance.
        degrees: Whether the rotation vector is in degrees.
    """
    numbers = _numbers(text)
    if len(numbers) not in ({3} if by else {3, 6}):
        unit = "degrees" if degrees else "rad"
        wanted = (
            "a distance dx,dy,dz in m" if by else f"a position x,y,z in m, or x,y,z,rx,ry,rz in m and {unit}"
        )
        raise Failure(f"target is {quoted(text)}: must be {wanted}", code=2)
    turn = tuple(map(math.radians, numbers[3:])) if degrees else numbers[3:]
    return numbers[:3] + turn


def _numbers(text: str) -> tuple[float, ...]:
    """Numbers separated by commas; none if the text is anything else."""
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()

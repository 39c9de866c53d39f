"""Parse poses as users type them: a name, joint angles, or a pose of the tool."""

import math
from collections.abc import Mapping

from tvist_cli.failure import Failure
from tvist_protocol.errors import quoted


def pose(
    text: str, poses: Mapping[str, tuple[float, ...]], what: str, *, degrees: bool = False
) -> tuple[float, ...]:
    """Return the joint angles [rad] of a named pose, in any case, or of angles separated by commas.

    `what` names the argument in the message of the Failure.
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
    """Parse a target of the tool: displacement or position [m], or position [m] and rotation vector [rad]."""
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
    """Parse numbers separated by commas; return nothing if the text is anything else."""
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()

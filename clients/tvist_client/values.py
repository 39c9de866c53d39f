"""Conversion of users' values, such as lists, tuples and arrays, to the numbers in messages."""

import contextlib
import math
import operator
from collections.abc import Iterable

from tvist_client.errors import ArgumentError
from tvist_protocol.errors import quoted
from tvist_protocol.info import Info


def number(value: float, where: str) -> float:
    """Convert a value to a float; the robot checks its range."""
    # `float` would also parse text, which cannot be intended here.
    if not isinstance(value, str | bytes):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            return float(value)
    raise ArgumentError(where, f"{where} is {quoted(value)}: must be a number")


def positive(value: float, where: str) -> float:
    """Convert a value to a finite float above 0."""
    found = number(value, where)
    if not 0.0 < found < math.inf:
        raise ArgumentError(where, f"{where} is {found:g}: must be more than 0, and finite", 0.0)
    return found


def whole(value: int, where: str, low: int, high: int | None = None) -> int:
    """Convert a value to an integer within bounds."""
    allowed = f"at least {low}" if high is None else f"from {low} to {high}"
    try:
        found = operator.index(value)
    except TypeError:
        raise ArgumentError(where, f"{where} is {quoted(value)}: must be a whole number, {allowed}") from None
    if found < low or (high is not None and found > high):
        raise ArgumentError(where, f"{where} is {found}: must be {allowed}", low if found < low else high)
    return found


def joint_angles(q: Iterable[float], info: Info, where: str = "q") -> tuple[float, ...]:
    """Convert joint angles to floats, and check them, because a robot does not answer invalid set-points."""
    entries = None
    if not isinstance(q, str | bytes):
        with contextlib.suppress(TypeError):
            entries = tuple(q)
    if entries is None:
        raise ArgumentError(where, f"{where} is {quoted(q)}: must be a list of numbers")
    angles = tuple(number(angle, f"{where}[{place}]") for place, angle in enumerate(entries))
    if len(angles) != (joints := len(info.joints)):
        why = f"{where} has {len(angles)} angles; this arm has {joints} joints: give one per joint"
        raise ArgumentError(where, why, joints)
    for place, (angle, (low, high)) in enumerate(zip(angles, info.limits.position, strict=True)):
        if low <= angle <= high and math.isfinite(angle):
            continue
        field = f"{where}[{place}]"
        if not math.isfinite(angle):
            raise ArgumentError(field, f"{field} is {angle}: must be a finite number of rad")
        why = f"{field} is {angle:g} rad: joint {info.joints[place]} allows {low:g} to {high:g} rad"
        raise ArgumentError(field, why, low if angle < low else high)
    return angles

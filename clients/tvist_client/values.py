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


class JointRange:
    """The joint angles that a robot accepts; set-points are checked here because the robot does not answer them."""

    def __init__(self, info: Info) -> None:
        self._joints = info.joints
        self._ranges = info.limits.position

    def check(self, q: Iterable[float], where: str = "q") -> tuple[float, ...]:
        """Convert joint angles to floats, and check that the robot accepts them."""
        entries = None
        if not isinstance(q, str | bytes):
            with contextlib.suppress(TypeError):
                entries = tuple(q)
        if entries is None:
            raise ArgumentError(where, f"{where} is {quoted(q)}: must be a list of numbers")
        angles = tuple(number(angle, f"{where}[{place}]") for place, angle in enumerate(entries))
        joints, ranges = self._joints, self._ranges
        if len(angles) != len(joints):
            why = f"{where} has {len(angles)} angles; this arm has {len(joints)} joints: give one per joint"
            raise ArgumentError(where, why, len(joints))
        for place, (angle, (low, high)) in enumerate(zip(angles, ranges, strict=True)):
            if low <= angle <= high:
                continue
            field = f"{where}[{place}]"
            if not math.isfinite(angle):
                raise ArgumentError(field, f"{field} is {angle}: must be a finite number of rad")
            why = f"{field} is {angle:g} rad; joint {joints[place]} allows {low:g} to {high:g} rad"
            raise ArgumentError(field, why, low if angle < low else high)
        return angles

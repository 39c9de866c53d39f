"""Conversion of users' values, such as lists, tuples and arrays, to the numbers in messages."""

import contextlib
import math
import operator
from collections.abc import Iterable
from typing import TypeVar

from tvist_client.errors import ArgumentError
from tvist_protocol.errors import quoted
from tvist_protocol.info import Info

T = TypeVar("T")
Joints = tuple[float, ...]
Six = tuple[float, float, float, float, float, float]


def number(value: float, where: str) -> float:
    """Convert a value to a float; its range is checked by the robot.

    Args:
        value: Anything that represents one number.
        where: Name of the argument, for error messages.

    Raises:
        ArgumentError: The value has the wrong type or length.
    """
    # `float` would also parse text, which cannot be intended here.
    if not isinstance(value, str | bytes):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            return float(value)
    raise ArgumentError(where, f"{where} is {quoted(value)}: must be a number")


def optional_number(value: float | None, where: str) -> float | None:
    """Convert a value to a float, and leave None as it is; see `number`."""
    return None if value is None else number(value, where)


def positive(value: float, where: str) -> float:
    """Convert a value to a finite float above 0.

    Raises:
        ArgumentError: The value is not such a number.
    """
    found = number(value, where)
    if not 0.0 < found < math.inf:
        raise ArgumentError(where, f"{where} is {found:g}: must be more than 0, and finite", 0.0)
    return found


def whole(value: int, where: str, low: int, high: int | None = None) -> int:
    """Convert a value to an integer within bounds.

    Args:
        value: Anything that represents an integer.
        where: Name of the argument, for error messages.
        low: Smallest permitted value.
        high: Largest permitted value; None for no bound.

    Raises:
        ArgumentError: The value is not a number, or out of range.
    """
    allowed = f"at least {low}" if high is None else f"from {low} to {high}"
    try:
        found = operator.index(value)
    except TypeError:
        raise ArgumentError(where, f"{where} is {quoted(value)}: must be a whole number, {allowed}") from None
    if found < low or (high is not None and found > high):
        raise ArgumentError(where, f"{where} is {found}: must be {allowed}", low if found < low else high)
    return found


def floats(values: Iterable[float], where: str, meaning: str | None = None) -> Joints:
    """Convert a sequence of numbers to floats.

    Args:
        values: List, tuple or array.
        where: Name of the argument, for error messages.
        meaning: One word for each number, if their count is known here; otherwise the robot checks it.

    Raises:
        ArgumentError: A value is not a number, or their count is wrong.
    """
    listed = entries(values, where)
    if meaning is not None and len(listed) != (count := len(meaning.split())):
        why = f"{where} has {len(listed)} numbers: must have {count}, {meaning}"
        raise ArgumentError(where, why, count)
    return tuple(number(entry, f"{where}[{place}]") for place, entry in enumerate(listed))


def pose_of(values: Iterable[float], where: str) -> Six:
    """Convert x y z [m] and a rotation vector [rad] to floats; see `floats`."""
    x, y, z, rx, ry, rz = floats(values, where, "x y z rx ry rz")
    return x, y, z, rx, ry, rz


def optional_pose(values: Iterable[float] | None, where: str) -> Six | None:
    """Convert a pose to floats, and leave None as it is; see `pose_of`."""
    return None if values is None else pose_of(values, where)


def twist_of(values: Iterable[float], where: str) -> Six:
    """Convert a velocity [m/s] and an angular velocity [rad/s] to floats; see `floats`."""
    vx, vy, vz, wx, wy, wz = floats(values, where, "vx vy vz wx wy wz")
    return vx, vy, vz, wx, wy, wz


def entries(values: Iterable[T], where: str, of: str = "numbers") -> tuple[T, ...]:
    """Return the entries of a sequence unchanged.

    Args:
        values: List, tuple or array.
        where: Name of the argument, for error messages.
        of: What the entries are, for error messages.

    Raises:
        ArgumentError: The value is not a sequence.
    """
    if not isinstance(values, str | bytes):
        with contextlib.suppress(TypeError):
            return tuple(values)
    raise ArgumentError(where, f"{where} is {quoted(values)}: must be a list of {of}")


class JointRange:
    """The joint angles that a robot accepts; set-points are checked here because the robot does not answer them.

    Args:
        info: Description of the robot.
    """

    def __init__(self, info: Info) -> None:
        self._joints = info.joints
        self._ranges = info.limits.position

    def check(self, q: Iterable[float], where: str = "q") -> Joints:
        """Convert joint angles to floats, and check that the robot accepts them.

        Args:
            q: One angle per joint [rad].
            where: Name of the argument, for error messages.

        Raises:
            ArgumentError: An angle is not a number, not finite or outside its joint's range, or their count is wrong.
        """
        angles = floats(q, where)
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

"""What users hand over, to numbers as messages have them: lists, tuples and arrays alike."""

import contextlib
import math
import operator
from collections.abc import Iterable

from tvist_client.errors import ArgumentError
from tvist_protocol.errors import quoted
from tvist_protocol.info import Info

Joints = tuple[float, ...]


def number(value: float, where: str) -> float:
    """A plain float; the robot checks how large it may be.

    Args:
        value: Anything that stands for one number.
        where: Name of the argument, for the message.

    Raises:
        ArgumentError: The value has the wrong type or length.
    """
    # `float` reads text, which nobody means who moves a robot.
    if not isinstance(value, str | bytes):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            return float(value)
    raise ArgumentError(where, f"{where} is {quoted(value)}: must be a number")


def whole(value: int, where: str, low: int, high: int | None = None) -> int:
    """An integer within bounds.

    Args:
        value: Anything that stands for an integer.
        where: Name of the argument, for the message.
        low: Smallest that is allowed.
        high: Largest that is allowed; None: there is no bound.

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
    """Plain floats of any sequence of numbers.

    Args:
        values: List, tuple, array.
        where: Name of the argument, for the message.
        meaning: One word for each number, where their count is known here; otherwise the robot checks it.

    Raises:
        ArgumentError: They are no numbers, or another count.
    """
    listed = entries(values, where)
    if meaning is not None and len(listed) != (count := len(meaning.split())):
        why = f"{where} has {len(listed)} numbers: must have {count}, {meaning}"
        raise ArgumentError(where, why, count)
    return tuple(number(entry, f"{where}[{place}]") for place, entry in enumerate(listed))


def entries(values: Iterable[float], where: str) -> tuple[float, ...]:
    """What a sequence holds, as it stands there.

    Raises:
        ArgumentError: The value has the wrong type or length.
    """
    if not isinstance(values, str | bytes):
        with contextlib.suppress(TypeError):
            return tuple(values)
    raise ArgumentError(where, f"{where} is {quoted(values)}: must be a list of numbers")


class JointRange:
    """The joint angles that a robot takes: checked here where nobody answers, as with set-points.

    Args:
        info: What the robot says of itself.
    """

    def __init__(self, info: Info) -> None:
        self._joints = info.joints
        self._ranges = info.limits.position

    def check(self, q: Iterable[float], where: str = "q") -> Joints:
        """Plain floats of joint angles that the robot takes.

        Args:
            q: One angle per joint [rad].
            where: Name of the argument, for the message.

        Raises:
            ArgumentError: They are no numbers, another count, not finite or beyond a joint's range.
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

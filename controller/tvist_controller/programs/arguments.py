"""Checks of what a program passes to a function, and conversion to the controller's types.

Bounds are those of the protocol: beyond them, a plan may take all memory.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import get_args

from tvist_protocol import values
from tvist_protocol.values import Coordinate
from tvist_urscript import Array, Fault, Pose

Value = object


@cache
def bounds(kind: object) -> tuple[float, float]:
    """Return the least and the largest number of one of the protocol's types, such as `Mass`."""
    meta = get_args(kind)[1]
    return meta.ge if meta.gt is None else meta.gt, meta.le


def number(name: str, value: Value, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a finite number within bounds.

    Raises:
        Fault: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Fault(f"{name} is {shown(value)}: it must be a number")
    if not least <= value <= most or not math.isfinite(value):
        raise Fault(f"{name} is {value:g}: it must be {_range(least, most)}")
    return float(value)


def positive(name: str, value: Value, most: float = math.inf) -> float:
    """Return a finite number above zero.

    Raises:
        Fault: It is none.
    """
    found = number(name, value, most=most)
    if found <= 0.0:
        raise Fault(f"{name} is {found:g}: it must be above 0")
    return found


def integer(name: str, value: Value, least: int, most: int) -> int:
    """Return an integer within bounds; a float without a fraction counts as one.

    Raises:
        Fault: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value // 1:
        raise Fault(f"{name} is {shown(value)}: it must be an integer")
    if not least <= value <= most:
        raise Fault(f"{name} is {value:g}: it must be {_range(least, most)}")
    return int(value)


def numbers(name: str, value: Value, count: int, kind: object = Coordinate) -> tuple[float, ...]:
    """Return the numbers of a list or a pose.

    The protocol's type of one of them bounds each; angles and speeds have the bounds of coordinates.

    Raises:
        Fault: It is no list of so many numbers.
    """
    if not isinstance(value, Array):
        raise Fault(f"{name} is {shown(value)}: it must be a list of {count} numbers")
    items = value.items
    if len(items) != count:
        raise Fault(f"{name} has {len(items)} elements: it must have {count}")
    least, most = bounds(kind)
    return tuple([number(f"{name}[{k}]", item, least, most) for k, item in enumerate(items)])


def pose(name: str, value: Value, kind: object = Coordinate) -> values.Pose:
    """Return the six numbers of a pose; a list of six numbers counts as one.

    Raises:
        Fault: It is none.
    """
    x, y, z, rx, ry, rz = numbers(name, value, 6, kind)
    return x, y, z, rx, ry, rz


def is_pose(value: Value) -> bool:
    """Return whether a target is a pose rather than joint positions."""
    return isinstance(value, Pose)


def flag(name: str, value: Value) -> bool:
    """Return a truth value; numbers count as such.

    Raises:
        Fault: It is none.
    """
    if not isinstance(value, bool | int | float):
        raise Fault(f"{name} is {shown(value)}: it must be True or False")
    return bool(value)


def text(name: str, value: Value) -> str:
    """Return a text.

    Raises:
        Fault: It is none.
    """
    if not isinstance(value, str):
        raise Fault(f"{name} is {shown(value)}: it must be a text")
    return value


def a_list(values: Sequence[float]) -> Array:
    """Return a list of numbers as programs have it."""
    return Array(tuple(values))


def a_pose(values: Sequence[float]) -> Pose:
    """Return a pose as programs have it."""
    return Pose(tuple(values))


def shown(value: Value) -> str:
    """Return a value for a message."""
    return "None" if value is None else f"{value}"[:60]


def readable(text: str) -> str:
    """Return a text for people; parts of characters, which programs can cut out, are replaced."""
    return text if text.isascii() else text.encode(errors="surrogateescape").decode(errors="replace")


def _range(least: float, most: float) -> str:
    if math.isinf(most):
        return "finite" if math.isinf(least) else f"at least {least:g} and finite"
    return f"at most {most:g}" if math.isinf(least) else f"from {least:g} to {most:g}"

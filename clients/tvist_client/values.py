"""Numbers as users have them, to numbers as messages have them: lists, tuples and arrays alike."""

from collections.abc import Iterable

Joints = tuple[float, ...]


def floats(values: Iterable[float]) -> Joints:
    """Plain floats of any sequence of numbers; the robot checks how many and how large."""
    return tuple(float(value) for value in values)

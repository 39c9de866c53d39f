"""Arguments of program functions: checks according to annotations, and conversion to the controller's types.

A parameter's annotation contains its check as metadata, or is a number type of the protocol with bounds, such
as `Mass`; values beyond them could make a plan take all memory. Other values are passed on unchanged.
"""

import inspect
import math
from collections.abc import Callable, Sequence
from functools import cache
from types import MethodType, NoneType
from typing import Annotated, Any, Final, get_args, get_origin

from msgspec import Meta

from tvist_protocol import values
from tvist_protocol.values import Coordinate
from tvist_urscript import Array, Fault, Pose

Value = object
Check = Callable[[str, Value], Any]  # Converts a program's value for a named parameter, or raises a `Fault`
OF_JOINTS: Final = "joints"
"""Stands for `several` with the arm's number of joints, which annotations do not know."""


def checked(method: MethodType, joints: int) -> Callable[..., Any]:
    """Wrap a method: check its positional arguments as annotated; `Joints` must have `joints` elements."""
    checks = _checks(method.__func__, joints)
    if not any(check for _, check in checks):
        return method

    def call(*given: Value) -> Any:
        pairs = zip(checks, given, strict=True)
        return method(*[value if check is None else check(name, value) for (name, check), value in pairs])

    return call


@cache
def _checks(function: Callable[..., Any], joints: int) -> list[tuple[str, Check | None]]:
    _, *parameters = inspect.signature(function).parameters.values()
    return [(one.name, _check_of(one.annotation, joints)) for one in parameters]


def _check_of(annotation: Any, joints: int) -> Check | None:
    if get_origin(annotation) is not Annotated:
        parts = get_args(annotation)
        inner = _check_of(parts[0], joints) if NoneType in parts else None
        return None if inner is None else lambda name, value: None if value is None else inner(name, value)
    check: Any = get_args(annotation)[-1]  # follows the protocol's metadata
    if isinstance(check, Meta):
        return within(*bounds(annotation))
    found: Check = several(joints) if check == OF_JOINTS else check
    return found


@cache
def bounds(kind: object) -> tuple[float, float]:
    """Return the bounds of one of the protocol's number types, such as `Mass`."""
    meta = get_args(kind)[1]
    return meta.ge if meta.gt is None else meta.gt, meta.le


# ---------------------------------------------------------------------- checks


def number(name: str, value: Value, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a finite number within bounds."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Fault(f"{name} is {shown(value)}: it must be a number")
    if not least <= value <= most or not math.isfinite(value):
        raise Fault(f"{name} is {value:g}: it must be {_range(least, most)}")
    return float(value)


def within(least: float = -math.inf, most: float = math.inf) -> Check:
    """Return the check for a finite number within bounds."""
    return lambda name, value: number(name, value, least, most)


def above_zero(most: float = math.inf) -> Check:
    """Return the check for a finite number above zero."""

    def check(name: str, value: Value) -> float:
        found = number(name, value, most=most)
        if found <= 0.0:
            raise Fault(f"{name} is {found:g}: it must be above 0")
        return found

    return check


def integer(name: str, value: Value, least: int, most: int) -> int:
    """Return an integer within bounds; a float without fraction is accepted."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value // 1:
        raise Fault(f"{name} is {shown(value)}: it must be an integer")
    return int(number(name, value, least, most))


def whole(least: int, most: int) -> Check:
    """Return the check for an integer within bounds."""
    return lambda name, value: integer(name, value, least, most)


def either(name: str, value: Value) -> bool:
    """Convert 0 or 1 to a truth value."""
    return bool(integer(name, value, 0, 1))


def numbers(name: str, value: Value, count: int, kind: object = Coordinate) -> tuple[float, ...]:
    """Return the numbers of a list or pose, bounded by the protocol's type `kind`."""
    if not isinstance(value, Array):
        raise Fault(f"{name} is {shown(value)}: it must be a list of {count} numbers")
    items = value.items
    if len(items) != count:
        raise Fault(f"{name} has {len(items)} elements: it must have {count}")
    least, most = bounds(kind)
    return tuple([number(f"{name}[{k}]", item, least, most) for k, item in enumerate(items)])


def several(count: int, kind: object = Coordinate) -> Check:
    """Return the check for a list or pose of `count` numbers, see `numbers`."""
    return lambda name, value: numbers(name, value, count, kind)


def pose(name: str, value: Value, kind: object = Coordinate) -> values.Pose:
    """Return the six numbers of a pose or list."""
    x, y, z, rx, ry, rz = numbers(name, value, 6, kind)
    return x, y, z, rx, ry, rz


def flag(name: str, value: Value) -> bool:
    """Return a truth value; numbers are accepted."""
    if not isinstance(value, bool | int | float):
        raise Fault(f"{name} is {shown(value)}: it must be True or False")
    return bool(value)


def text(name: str, value: Value) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise Fault(f"{name} is {shown(value)}: it must be a text")
    return value


def word(*known: str) -> Check:
    """Return the check for one of some words."""
    *others, last = [f'"{one}"' for one in known]

    def check(name: str, value: Value) -> Value:
        if value not in known:
            raise Fault(f"{name} is {shown(value)}: it must be {', '.join(others)} or {last}")
        return value

    return check


Number = Annotated[float, within()]
Positive = Annotated[float, above_zero()]
Share = Annotated[float, within(0.0, 1.0)]
Bit = Annotated[int, whole(0, 1)]
Flag = Annotated[bool, flag]
Text = Annotated[str, text]
Joints = Annotated[tuple[float, ...], OF_JOINTS]
Vector3 = Annotated[tuple[float, ...], several(3)]
Vector6 = Annotated[tuple[float, ...], several(6)]
Target = Annotated[values.Pose, pose]

# ---------------------------------------------------------------------- return values and texts


def a_list(values: Sequence[float]) -> Array:
    """Return numbers as a list of the program."""
    return Array(tuple(values))


def a_pose(values: Sequence[float]) -> Pose:
    """Return numbers as a pose of the program."""
    return Pose(tuple(values))


def shown(value: Value) -> str:
    """Return a value as text for a message."""
    return "None" if value is None else f"{value}"[:60]


def readable(text: str) -> str:
    """Return a printable text; replace incomplete characters, which programs can create by cutting texts."""
    return text if text.isascii() else text.encode(errors="surrogateescape").decode(errors="replace")


def _range(least: float, most: float) -> str:
    if math.isinf(most):
        return "finite" if math.isinf(least) else f"at least {least:g} and finite"
    return f"at most {most:g}" if math.isinf(least) else f"from {least:g} to {most:g}"

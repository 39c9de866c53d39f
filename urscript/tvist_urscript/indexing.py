"""Read elements of lists, poses and matrices, and copy a list with another value for one element."""

from typing import Any

from tvist_urscript.arithmetic import Work
from tvist_urscript.errors import Fault
from tvist_urscript.values import Array, Pose, Struct, Value, integer, kind, number


def element(value: Value, index: Any) -> Value:
    """Return value[index]."""
    items = _array(value).items
    if type(index) is int and 0 <= index < len(items):
        return items[index]
    return items[_place(index, value)]  # type: ignore[arg-type]


def element_of_matrix(value: Value, row: Any, column: Any) -> Value:
    """Return value[row, column]."""
    return element(element(value, row), column)


def member(value: Value, name: str) -> Value:
    """Return value.name."""
    return _struct(value).items[_named(name, value)]  # type: ignore[arg-type]


def replaced(new: Value, indices: tuple[Any, ...], value: Value, work: Work) -> Array:
    """Return a copy of a list with another value for the element at these indices.

    Copying four elements costs one evaluation.
    """
    step = indices[0]
    if type(step) is tuple:  # a member's name
        whole: Array = _struct(value)
        place = _named(step[0], whole)  # type: ignore[arg-type]
    else:
        whole = _array(value)
        place = _place(step, whole)
    inner = new if len(indices) == 1 else replaced(new, indices[1:], whole.items[place], work)
    work(len(whole.items) // 4)
    items = list(whole.items)
    if type(whole) is Pose:
        items[place] = number(inner, "an element of a pose")
        return Pose(items)
    items[place] = inner
    return Struct(whole.names, items) if type(whole) is Struct else Array(items)


def _array(value: Value) -> Array:
    if isinstance(value, Array):
        return value
    raise Fault(f"{kind(value)} has no elements")


def _struct(value: Value) -> Struct:
    if type(value) is Struct:
        return value
    raise Fault(f"{kind(value)} has no members")


def _named(name: str, value: Struct) -> int:
    try:
        return value.names.index(name)
    except ValueError:
        raise Fault(f"the struct has no member {name}: it has {', '.join(value.names)}"[:200]) from None


def _place(index: Any, value: Array) -> int:
    place = integer(index, "a list index")
    length = len(value.items)
    what = "pose" if type(value) is Pose else "struct" if type(value) is Struct else "list"
    has = f"the {what} has {length} element{'' if length == 1 else 's'}"
    if place < 0:
        raise Fault(f"list index {place} is negative: {has}")
    if place >= length:
        raise Fault(f"list index {place} is beyond the end: {has}")
    return place

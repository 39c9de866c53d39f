"""Converts users' arguments to the fields of messages, according to the fields' types; the robot checks ranges."""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache, reduce
from operator import or_
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

from msgspec import Meta, Struct
from msgspec.structs import FieldInfo, fields

from tvist_client.errors import ArgumentError
from tvist_client.values import listed, number, whole
from tvist_protocol.errors import quoted
from tvist_protocol.values import DampingRatios, Frequencies, Payload

S = TypeVar("S", bound=Struct)
Convert = Callable[[Any, str], Any]


class ArgumentFormat(NamedTuple):
    """How users pass a value."""

    kind: Any  # its type in users' programs
    convert: Convert  # converts the value; the second argument is its name for error messages, such as `q[3]`


class Argument(NamedTuple):
    """A field of a message that users pass."""

    field: FieldInfo
    given: ArgumentFormat


@cache
def arguments(kind: type[Struct]) -> dict[str, Argument]:
    """Return the arguments of a message by name."""
    return {
        field.name: Argument(field, given(field.type))
        for field in fields(kind)
        if field.name not in {"token", "protocol", *_constants(kind)}
    }


def built(kind: type[S], values: Mapping[str, Any], place: str = "", **known: Any) -> S:
    """Build a message, or a part of one, from users' values; `place` precedes their names in error messages."""
    taken = arguments(kind)
    converted = {name: taken[name].given.convert(value, place + name) for name, value in values.items()}
    return kind(**_constants(kind), **converted, **known)


def make_payload(mass: float, com: Iterable[float], inertia: Iterable[float]) -> Payload:
    """Create a payload.

    Args:
        mass: Mass [kg].
        com: Centre of mass x y z in the flange frame [m].
        inertia: xx xy xz yy yz zz about the centre of mass, flange axes [kg m²].

    Raises:
        ArgumentError: An argument is not a number, or has the wrong number of entries.
    """
    return built(Payload, {"mass": mass, "com": com, "inertia": inertia})


def given(hint: Any) -> ArgumentFormat:
    """Return how users pass a field of this type."""
    if hint in {Frequencies, DampingRatios}:
        return ArgumentFormat(float | Iterable[float], _one_or_more)
    hint, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    meaning = next((mark for mark in marks if isinstance(mark, str)), None)
    bounds = next((mark for mark in marks if isinstance(mark, Meta)), Meta())
    origin, parts = get_origin(hint), get_args(hint)
    if origin is tuple:
        return _list(parts, meaning, bounds)
    if kinds := _structs(hint):
        return ArgumentFormat(hint, lambda value, where: _struct(value, where, kinds))
    if origin in {Union, UnionType}:
        return _choice(parts)
    simple: dict[Any, Convert] = {
        float: number,
        int: lambda value, where: whole(value, where, int(bounds.ge or 0)),
        bool: _switch,
    }
    return ArgumentFormat(Mapping[str, Any] if origin is dict else hint, simple.get(hint, _unchanged))


def _list(parts: tuple[Any, ...], meaning: str | None, bounds: Meta) -> ArgumentFormat:
    """Return how users pass a tuple. The robot explains a wrong number of angles better than the type's bounds do."""
    entry = given(parts[0])
    count = None if parts[-1] is Ellipsis else len(parts)

    def convert(values: Any, where: str) -> Any:
        if not _structs(parts[0]):
            return listed(values, where, entry.convert, count=count, meaning=meaning)
        found = listed(values, where, entry.convert, of=where)
        low, high = bounds.min_length or 0, bounds.max_length or math.inf
        if not low <= len(found) <= high:
            why = f"{where} has {len(found)} entries: must have from {low} to {high}"
            raise ArgumentError(where, why, low if len(found) < low else high)
        return found

    return ArgumentFormat(GenericAlias(Iterable, entry.kind), convert)


def _choice(members: tuple[Any, ...]) -> ArgumentFormat:
    """Return how users pass a value of one of several types; None and words are passed as such."""
    words = {word for member in members if get_origin(member) is Literal for word in get_args(member)}
    constants = [member for member in members if member is NoneType or get_origin(member) is Literal]
    others = [given(member) for member in members if member not in constants]
    kinds = [other.kind for other in others] + constants
    inner = others[0].convert if len(others) == 1 else _unchanged

    def convert(value: Any, where: str) -> Any:
        as_it_is = (value is None and NoneType in members) or (isinstance(value, str) and value in words)
        return value if as_it_is else inner(value, where)

    return ArgumentFormat(reduce(or_, kinds), convert)


def _unchanged(value: Any, _: str) -> Any:
    return dict(value) if isinstance(value, Mapping) else value


def _one_or_more(values: Any, where: str) -> tuple[float, ...]:
    """Convert a single number, or one number for each mode."""
    return listed(values, where, number) if isinstance(values, Iterable) else (number(values, where),)


def _switch(value: Any, _: str) -> Any:
    """Also accept 0, 1 and numpy's True and False; the robot refuses everything else."""
    numeric = hasattr(value, "__bool__") and not hasattr(value, "__len__")
    return bool(value) if numeric and value in {0, 1} else value


def _struct(value: Any, where: str, kinds: tuple[type[Struct], ...]) -> Struct:
    # A struct's constructor validates nothing.
    if not isinstance(value, kinds):
        *others, last = (kind.__name__ for kind in kinds)
        names = f"{', '.join(others)} or {last}" if others else last
        raise ArgumentError(where, f"{where} is {quoted(value)}: must be a {names}")
    return built(type(value), {name: getattr(value, name) for name in arguments(type(value))}, f"{where}.")


def _structs(hint: Any) -> tuple[type[Struct], ...]:
    """Return the structs that a value may be; empty if it may be something else."""
    kinds = get_args(hint) if get_origin(hint) in {Union, UnionType} else (hint,)
    return kinds if all(isinstance(kind, type) and issubclass(kind, Struct) for kind in kinds) else ()


@cache
def _constants(kind: type[Struct]) -> dict[str, Any]:
    return {field.name: only for field in fields(kind) if (only := _constant(field.type)) is not None}


def _constant(hint: Any) -> Any:
    """Return the only value that a type allows; None if it allows others."""
    return get_args(hint)[0] if get_origin(hint) is Literal and len(get_args(hint)) == 1 else None

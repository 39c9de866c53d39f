"""Builds messages from users' arguments, which are checked against the types of the messages' fields."""

from collections.abc import Iterable, Mapping
from decimal import Decimal
from functools import cache, reduce
from operator import or_
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

import msgspec
from msgspec import Struct
from msgspec.structs import FieldInfo, fields

from tvist_client.errors import ArgumentError
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError, quoted
from tvist_protocol.forces import Choices
from tvist_protocol.values import DampingRatios, Frequencies, Payload

S = TypeVar("S", bound=Struct)
_UNIONS = {Union, UnionType}


class Argument(NamedTuple):
    """A field of a message that users pass."""

    field: FieldInfo
    kind: Any  # type of the argument in users' programs


@cache
def arguments(kind: type[Struct]) -> dict[str, Argument]:
    """Return the arguments of a message by name."""
    return {
        field.name: Argument(field, _kind(field.type))
        for field in fields(kind)
        if field.name not in {"token", "protocol", *_constants(kind)}
    }


def built(kind: type[S], values: Mapping[str, Any], **known: Any) -> S:
    """Build a message, or a part of one, from users' values; raise ArgumentError if one does not fit its field."""
    content = {name: _plain(value, name, arguments(kind)[name].field.type) for name, value in values.items()}
    try:
        return checked({**_constants(kind), **content, **known}, kind)
    except ProtocolError as error:
        raise ArgumentError(error.where, error.why, error.limit) from None


def make_payload(mass: float, com: Iterable[float], inertia: Iterable[float]) -> Payload:
    """Create a payload.

    Args:
        mass: Mass [kg].
        com: Centre of mass x y z in the flange frame [m].
        inertia: xx xy xz yy yz zz about the centre of mass, flange axes [kg m²].

    Raises:
        ArgumentError: An argument is not a number, is out of range, or has the wrong number of entries.
    """
    return built(Payload, {"mass": mass, "com": com, "inertia": inertia})


def _plain(value: Any, name: str, hint: Any) -> Any:
    """Convert to numbers, strings and lists; one frequency or ratio becomes a list, 1 for a bool True."""
    try:
        plain = msgspec.to_builtins(value, builtin_types=(bytes, bytearray, Decimal), enc_hook=_builtin)
    except (TypeError, RecursionError, OverflowError) as error:
        raise ArgumentError(
            name, f"{name} is {quoted(value)}: must consist of numbers, lists and strings"
        ) from error
    members = get_args(hint) if get_origin(hint) in _UNIONS else (hint,)
    if {Frequencies, DampingRatios} & set(members) and isinstance(plain, int | float):
        return [plain]
    if Choices in members and isinstance(plain, list):
        return [_switch(entry) for entry in plain]
    return _switch(plain) if hint is bool else plain


def _builtin(value: Any) -> Any:
    """Convert values that are not Python's own: numpy's arrays and numbers, other numbers, and iterators."""
    plain = value.tolist() if hasattr(value, "tolist") else value
    if type(plain) is not type(value):
        return plain
    return float(value) if hasattr(value, "__float__") else list(value)


def _switch(value: Any) -> Any:
    return bool(value) if isinstance(value, int | float) and value in {0, 1} else value


def _kind(hint: Any) -> Any:
    """Return the type that users' programs may give for a field of type `hint`."""
    if hint in {Frequencies, DampingRatios}:
        return float | Iterable[float]
    hint = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    origin, parts = get_origin(hint), get_args(hint)
    if origin is tuple:
        return GenericAlias(Iterable, _kind(parts[0]))
    if origin in _UNIONS:
        words = [part for part in parts if part is NoneType or get_origin(part) is Literal]
        return reduce(or_, [*(_kind(part) for part in parts if part not in words), *words])
    return Mapping[str, Any] if origin is dict else hint


@cache
def _constants(kind: type[Struct]) -> dict[str, Any]:
    """Return the fields that allow only one value."""
    only = {one.name: get_args(one.type) for one in fields(kind) if get_origin(one.type) is Literal}
    return {name: words[0] for name, words in only.items() if len(words) == 1}

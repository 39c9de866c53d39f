"""What is wrong with a message that was built here and cannot be written: mostly numpy's numbers."""

from collections.abc import Iterator
from enum import Enum

import msgspec

from tvist_protocol.errors import ProtocolError, short

_DEPTH = 32
"""Levels that are searched: a value that is nested deeper contains itself."""


def explain_unencodable(message: msgspec.Struct, error: Exception) -> ProtocolError:
    """Return the error of a message that cannot be written as MessagePack; it names the field and its value.

    Args:
        message: The message.
        error: The error of msgspec.
    """
    where, value = next(_unencodable(message, "", _DEPTH), ("", message))
    kind = f"{type(value).__module__}.{type(value).__qualname__}".removeprefix("builtins.")
    match value:
        case int():
            return ProtocolError("out_of_range", where, f"{where} does not fit into 64 bits")
        case str():
            why = f"{where} contains text that is not UTF-8"
        case msgspec.Struct():
            why = f"{kind} cannot be written: {short(str(error))}"
        case _:
            why = f"{where} is a {kind}: give Python's own numbers, lists and strings (float(x), x.tolist())"
    return ProtocolError("malformed", where, why)


def _unencodable(value: object, where: str, depth: int) -> Iterator[tuple[str, object]]:
    if depth == 0 or not _is_plain(value):
        yield where, value
        return
    for at, entry in _entries(value, where):
        yield from _unencodable(entry, at, depth - 1)


def _entries(value: object, where: str) -> Iterator[tuple[str, object]]:
    match value:
        case msgspec.Struct():
            for name in value.__struct_fields__:
                yield f"{where}.{name}".removeprefix("."), getattr(value, name)
        case list() | tuple():
            for index, entry in enumerate(value):
                yield f"{where}[{index}]", entry
        case dict():
            for key, entry in value.items():
                yield where, key
                yield f"{where}.{short(str(key))}", entry


def _is_plain(value: object) -> bool:
    if type(value) is int:
        return -(2**63) <= value < 2**64
    if type(value) is str:
        return not any("\ud800" <= character <= "\udfff" for character in value)
    return (
        value is None
        or type(value) in {bool, float, list, tuple, dict}
        or isinstance(value, Enum | msgspec.Struct)
    )

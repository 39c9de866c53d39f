"""CDR, the encoding of ROS 2 messages: XCDR1, little-endian, after a header of four bytes."""

import struct
from functools import cache
from typing import Any

from msgspec import Struct

from tvist_ros2.messages import FIELDS, parts_of, ros

HEADER = b"\x00\x01\x00\x00"
"""Identifies plain CDR, little-endian; the last two bytes are options. Values are aligned relative to its end."""
LARGEST = 1_000_000  # size beyond which decoding would take too long [byte]; robots take no such trajectory
_CODES = {
    "bool": "?", "int8": "b", "uint8": "B", "uint16": "H", "int32": "i", "uint32": "I", "float64": "d",
}  # fmt: skip


class CdrError(ValueError):
    """Data that is not an encoded message of the expected type."""


def encode(message: Struct) -> bytes:
    """Encode a message with its header."""
    out = bytearray()
    _write(out, type(message).__name__, message)
    return HEADER + bytes(out)


def decode(kind: type[Struct], data: bytes) -> Any:
    """Decode a message of a type, or raise CdrError; ignore bytes after its end."""
    if data[:2] != HEADER[:2]:
        raise CdrError(
            f"{kind.__name__} begins with {data[:2].hex()!r}: must begin with 0001 (little-endian)"
        )
    if len(data) > LARGEST:
        raise CdrError(f"{kind.__name__} has {len(data)} bytes: must have at most {LARGEST}")
    try:
        message, _ = _read(data[4:], 0, kind.__name__)
    except (struct.error, UnicodeDecodeError) as error:
        raise CdrError(f"{kind.__name__} of {len(data)} bytes cannot be decoded: {error}") from error
    return message


@cache
def _form(kind: str, count: int) -> struct.Struct:
    return struct.Struct(f"<{count}{_CODES[kind]}")


def _write(out: bytearray, kind: str, value: Any) -> None:
    """Append a value of a type in ROS 2's notation."""
    inner, several, size = parts_of(kind)
    if several and size is None:
        _write(out, "uint32", len(value))
    values = value if several else (value,)
    if inner in _CODES:
        if values:
            form = _form(inner, len(values))
            out += bytes(-len(out) % _form(inner, 1).size) + form.pack(*values)
    elif inner == "string":
        for text in values:
            _write(out, "uint8[]", text.encode() + b"\x00")
    else:
        for message in values:
            for field_kind, name in FIELDS[inner]:
                _write(out, field_kind, getattr(message, name))


def _read(data: bytes, at: int, kind: str) -> tuple[Any, int]:
    """Return the value of a type at a place, and the place after it."""
    inner, several, size = parts_of(kind)
    count = 1 if size is None else size
    if several and size is None:
        count, at = _read(data, at, "uint32")
    # Every entry has at least one byte; a wrong number must cost neither time nor memory.
    if at + count > len(data):
        raise struct.error(f"{count} entries from byte {at} on are more than the message has")
    values: list[Any] = []
    if inner in _CODES:
        if count:
            form, at = _form(inner, count), at + -at % _form(inner, 1).size
            values, at = list(form.unpack_from(data, at)), at + form.size
    elif inner == "string":
        for _ in range(count):
            text, at = _read(data, at, "uint8[]")
            values.append(text[:-1].decode())
    else:
        for _ in range(count):
            fields = []
            for field_kind, _ in FIELDS[inner]:
                field, at = _read(data, at, field_kind)
                fields.append(field)
            values.append(getattr(ros, inner)(*fields))
    if several:
        return bytes(values) if inner == "uint8" else values, at
    return values[0], at

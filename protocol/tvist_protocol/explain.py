"""Converts msgspec errors to code, field, message and limit; decodes short messages again to name values."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any, get_args

import msgspec

from tvist_protocol.errors import SHOWN, ProtocolError, quoted, short
from tvist_protocol.places import ABSENT, Place
from tvist_protocol.values import PATTERN_MEANINGS

FAULTS = (ValueError, TypeError, OverflowError, RecursionError, MemoryError)
"""Errors of msgspec: its own, UTF-8, unhashable keys, numbers beyond 64 bits, deep nesting, huge lengths."""

EXPLAINED_BYTES = 4096  # longest message whose values are named [bytes]

_DEPTH = 32  # levels that are searched; a value with more levels contains itself

Types = Mapping[str, type[msgspec.Struct]]  # the possible messages, by `type`


class _Head(msgspec.Struct):
    """The only field of a long message that is decoded again, so that errors can name the message's type."""

    type: str | None = None


class _Fault:
    """Place of a fault that msgspec found, and the value there."""

    def __init__(self, path: str, content: Any, kind: object, whole: str, types: Types) -> None:
        self.place = Place(content, kind, path)
        self.where = self.place.where
        self.whole = self.where or whole
        self.value = self.place.value
        self.types = types

    def out_of_range(self, wanted: str, limit: float | None = None) -> ProtocolError:
        given = "" if self.value is ABSENT else f" is {quoted(self.value)}:"
        return ProtocolError("out_of_range", self.where, f"{self.where}{given} must be {wanted}", limit)


def explain_refusal(error: msgspec.ValidationError, data: bytes, types: Types) -> ProtocolError:
    """Return an invalid message's error; if it is longer than `EXPLAINED_BYTES`, the error names no value."""
    message = _untyped(data, Any if len(data) <= EXPLAINED_BYTES else _Head)
    name = message.get("type") if isinstance(message, dict) else None
    return _explain(error, message, types.get(name) if isinstance(name, str) else None, "the message", types)


def explain_content(error: msgspec.ValidationError, content: Any, kind: object) -> ProtocolError:
    """Return the error of a file or map whose content has the wrong type."""
    return _explain(error, content, kind, "the content", {})


def _explain(
    error: msgspec.ValidationError, content: Any, kind: object, whole: str, types: Types
) -> ProtocolError:
    said, at, path = str(error), "", ""
    if found := _AT.fullmatch(said):
        said, at, path = found.groups()
    fault = _Fault(path, content, kind, whole, types)
    if at.endswith("in"):
        return ProtocolError("malformed", fault.where, f"{fault.whole} has a key that is not a string")
    for pattern, rule in _RULES:
        if found := pattern.fullmatch(said):
            return rule(fault, *found.groups())
    return ProtocolError("malformed", fault.where, f"{fault.whole}: {short(said)}")


def explain_unknown_type(name: object, types: Types) -> ProtocolError:
    """Return the error of a message with an unexpected `type`, with the most similar expected types."""
    near = list(types) if len(types) <= 3 else get_close_matches(str(name)[:SHOWN], types, n=3)
    return ProtocolError(
        "unknown_type", "type", f"type {quoted(name)} is unknown for this key{_suggest(near)}"
    )


def explain_bytes(error: Exception) -> ProtocolError:
    """Return the error of bytes that are not MessagePack."""
    said = str(error).removeprefix("MessagePack data is malformed: ")
    why = _BYTES.get(type(error)) or f"is not valid MessagePack: {short(said)}"
    return ProtocolError("malformed", "", f"the message {why}")


def _unknown_field(fault: _Fault, name: str) -> ProtocolError:
    expected = fault.place.struct
    known = () if expected is None else expected.__struct_fields__
    why = f"{fault.whole} has no field {quoted(name)}{_suggest(get_close_matches(name[:SHOWN], known, n=1))}"
    return ProtocolError("unknown_field", f"{fault.where}.{short(name)}".removeprefix("."), why)


def _missing_field(fault: _Fault, name: str) -> ProtocolError:
    where = f"{fault.where}.{name}".removeprefix(".")
    return ProtocolError("missing_field", where, f"{where} is missing")


def _length(fault: _Fault, kind: str, relation: str, limit: str) -> ProtocolError:
    things, one = ("characters", "character") if kind == "str" else ("entries", "entry")
    has = f" has {len(fault.value)} {things}:" if isinstance(fault.value, str | list | tuple) else ""
    kinds = (fault.place.kind, *get_args(fault.place.kind))
    meant = next((m for kind in kinds for m in getattr(kind, "__metadata__", ()) if isinstance(m, str)), None)
    each = "" if meant is None else f", {meant}"
    why = (
        f"{fault.whole}{has} must have {_RELATIONS[relation]} {limit} {one if limit == '1' else things}{each}"
    )
    return ProtocolError("out_of_range", fault.where, why, int(limit))


def _bound(fault: _Fault, relation: str, limit: str) -> ProtocolError:
    if isinstance(fault.value, float) and math.isnan(fault.value):
        return ProtocolError("out_of_range", fault.where, f"{fault.where} is NaN, not a number")
    return fault.out_of_range(f"{_RELATIONS[relation]} {float(limit):.15g}", float(limit))


def _pattern(fault: _Fault, said: str) -> ProtocolError:
    return fault.out_of_range(next((text for p, text in PATTERN_MEANINGS.items() if repr(p) == said), said))


def _choice(fault: _Fault) -> ProtocolError:
    return fault.out_of_range(f"one of {', '.join(fault.place.literals) or 'those in the protocol'}")


def _tag(fault: _Fault) -> ProtocolError:
    if fault.where == "type":
        return explain_unknown_type(fault.value, fault.types)
    given = "" if fault.value is ABSENT else f" is {quoted(fault.value)}:"
    why = f"{fault.where}{given} must be one of {', '.join(map(repr, fault.place.tags))}"
    return ProtocolError("unknown_type", fault.where, why)


def _kind(fault: _Fault, wanted: str, got: str) -> ProtocolError:
    # A boolean or bytes would be shown differently from what the sender wrote.
    if isinstance(fault.value, str | int | float) and got not in {"bool", "bytes"}:
        why = f"{fault.whole} is {quoted(fault.value)}: must be {_kinds(wanted)}"
    else:
        why = f"{fault.whole} must be {_kinds(wanted)}, not {_kinds(got)}"
    return ProtocolError("malformed", fault.where, why)


_AT = re.compile(r"(.*?)( - at `key` in| - at) `\$([^`]*)`", re.DOTALL)
_RULES: tuple[tuple[re.Pattern[str], Callable[..., ProtocolError]], ...] = (
    (re.compile(r"Object contains unknown field `(.*)`", re.DOTALL), _unknown_field),
    (re.compile(r"Object missing required field `(.*)`", re.DOTALL), _missing_field),
    (re.compile(r"Expected `(\w+)` of length (>= |<= |)(\d+)(?:, got \d+)?"), _length),
    (re.compile(r"Expected `\w+` (>= |<= |> |< )(\S+)"), _bound),
    (re.compile(r"Expected `str` matching regex (.*)", re.DOTALL), _pattern),
    (re.compile(r"Invalid enum value .*", re.DOTALL), _choice),
    (re.compile(r"Invalid value .*", re.DOTALL), _tag),
    (re.compile(r"Expected `([^`]*)`, got `([^`]*)`"), _kind),
    (re.compile(r"Number out of range"), lambda fault: fault.out_of_range("a number within ±1.8e308")),
)
_RELATIONS = {">= ": "at least", "<= ": "at most", "> ": "more than", "< ": "less than", "": "exactly"}
_KINDS = {
    "float": "a number", "int": "an integer", "str": "a string", "array": "a list", "object": "a map",
    "bool": "a boolean", "None": "null", "bytes": "a byte string", "ext": "an extension value",
}  # fmt: skip
_BYTES: dict[type, str] = {
    RecursionError: "is nested too deeply",
    UnicodeDecodeError: "contains text that is not UTF-8",
    MemoryError: "declares a length that exceeds memory",
}


def _kinds(said: str) -> str:
    return " or ".join(_KINDS.get(kind, kind) for kind in said.split(" | "))


def _suggest(near: Iterable[str]) -> str:
    names = " or ".join(map(repr, near))
    return f": did you mean {names}?" if names else ""


def _untyped(data: bytes, kind: Any) -> Any:
    try:
        return msgspec.to_builtins(msgspec.msgpack.decode(data, type=kind))
    except FAULTS:
        return ABSENT


def explain_unencodable(message: msgspec.Struct, error: Exception) -> ProtocolError:
    """Return the error of a message that cannot be written as MessagePack, with the field and its value."""
    where, value = _unencodable(message, "", _DEPTH)
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


def _unencodable(value: object, where: str, depth: int) -> tuple[str, object]:
    """Return place and value of the first part that has a type unknown to MessagePack."""
    for at, entry in _entries(value, where) if depth else ():
        try:
            msgspec.msgpack.encode(entry)
        except FAULTS:
            return _unencodable(entry, at, depth - 1)
    return where, value


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

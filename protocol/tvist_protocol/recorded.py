"""Messages as they stand in a recording: JSON, in the form that viewers of recordings open.

A recording is an MCAP file with channels `state`, `event`, `truth` and `journal`, their topics named as the
robot's keys. Its times are ticks of 2 ms as nanoseconds since tick 0, never the wall clock. Metadata `tvist`
holds the format, `info`, and `start` (how the server was started); metadata `tvist.end`, written when the
file is closed, what was dropped on each channel.

Viewers want one plain type a field and know no null. So a field that is null is left out here, and a list or
a field with null in it holds a number that is not finite, which JSON cannot say.
"""

import math
from collections.abc import Mapping
from typing import Any, Generic, TypeVar, get_args

import msgspec

from tvist_protocol import keys
from tvist_protocol.channels import tag
from tvist_protocol.errors import ProtocolError, short
from tvist_protocol.journal import Entry
from tvist_protocol.schema import json_schema
from tvist_protocol.stream import Event, State, Truth

Recorded = State | Event | Truth | Entry

FORMAT = "1"
"""Version of what is said above."""
TICK_NS = 2_000_000
"""Nanoseconds of a tick."""
METADATA = "tvist"
"""Name of the metadata written first: `format`, and `info` and `start` as JSON."""
END_METADATA = "tvist.end"
"""Name of the metadata written last: for each channel, how many messages were dropped."""

_Some = TypeVar("_Some", bound=Recorded)
_ENCODER = msgspec.json.Encoder()


def topics(robot: str) -> dict[type[msgspec.Struct], str]:
    """Topic of each kind of message.

    Raises:
        ProtocolError: The name may not stand in a key.
    """
    return {
        State: keys.state(robot),
        Event: keys.event(robot),
        Truth: keys.truth(robot),
        Entry: keys.state(robot).removesuffix("state") + tag(Entry),
    }


def to_json(message: Recorded) -> bytes:
    """One message as it is recorded. Every finite float comes back bit for bit.

    Raises:
        TypeError: A field holds what JSON cannot, a numpy number for instance.
    """
    content: dict[str, Any] = {"type": tag(type(message))}
    for name in message.__struct_fields__:
        value = getattr(message, name)
        if value is not None:
            content[name] = value
    return _ENCODER.encode(content)


class JsonReader(Generic[_Some]):
    """Reads recorded messages of one kind.

    Args:
        kind: Type of the message.
    """

    def __init__(self, kind: type[_Some]) -> None:
        self._kind = kind
        self._decoder = msgspec.json.Decoder(kind)
        self._absent = {
            field.encode_name: None
            for field in msgspec.structs.fields(kind)
            if field.required and type(None) in get_args(field.type)
        }
        self._before = _ENCODER.encode(self._absent)[:-1] + b"," if self._absent else b""

    def read(self, data: bytes) -> _Some:
        """One message; a number that was not finite is NaN.

        Raises:
            ProtocolError: It is no message of this kind.
        """
        try:
            try:
                return self._decoder.decode(self._completed(data))
            except msgspec.ValidationError:
                return msgspec.convert(self._with_nan(data), self._kind)
        except ValueError as error:
            why = f"a recorded message is no {tag(self._kind)}: {short(str(error))}"
            raise ProtocolError("malformed", "", why) from error

    def _completed(self, data: bytes) -> bytes:
        """With null for what was left out: of two equal keys msgspec keeps the later, which was there."""
        return self._before + data[1:] if self._before else data

    def _with_nan(self, data: bytes) -> Any:
        written = msgspec.json.decode(data)
        if not isinstance(written, dict):
            return written
        return self._absent | {name: _nan_for_null(value) for name, value in written.items()}


def viewer_schema(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """JSON Schema of a recorded message, in the part of JSON Schema that viewers know.

    They want `type` at every field, one and not null, `properties` at every object, and no reference.
    """
    schema = json_schema(kind)
    parts: Mapping[str, dict[str, Any]] = schema["properties"]
    required = [name for name in schema["required"] if not _has_null(parts[name])]
    return schema | {"properties": {name: _plain(part) for name, part in parts.items()}, "required": required}


def _plain(part: dict[str, Any]) -> dict[str, Any]:
    kept = {name: value for name, value in part.items() if name not in ("anyOf", "default")}
    if "anyOf" in part:
        (choice,) = (choice for choice in part["anyOf"] if choice != {"type": "null"})
        kept = choice | kept
    return kept if "type" in kept else {"type": "string"} | kept


def _has_null(part: Mapping[str, Any]) -> bool:
    return {"type": "null"} in part.get("anyOf", ())


def _nan_for_null(value: Any) -> Any:
    if isinstance(value, list):
        return [math.nan if entry is None else entry for entry in value]
    return math.nan if value is None else value

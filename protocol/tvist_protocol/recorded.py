"""Messages in a recording: JSON, in a form that viewers of recordings can open.

A recording is an MCAP file with channels `state`, `event`, `truth`, `io` and `journal`, whose topics are the robot's
keys. Its times are ticks of 2 ms as nanoseconds since tick 0, never the wall clock. Metadata `tvist` has the format,
`info`, and `start` (how the server was started); metadata `tvist.end` the messages dropped on each channel.

Viewers require one plain type per field, without null. A null field is therefore omitted, and null in a list
or field means that a number is not finite, which JSON cannot express.
"""

import math
import re
from collections.abc import Mapping
from glob import escape
from pathlib import PurePath
from typing import Any, Generic, TypeVar, get_args

import msgspec

from tvist_protocol import keys
from tvist_protocol.channels import tag
from tvist_protocol.errors import ProtocolError, short
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.schema import json_schema
from tvist_protocol.stream import Event, State, Truth

Recorded = State | Event | Truth | Io | Entry

FORMAT = "1"  # version of this format
TICK_NS = 2_000_000  # duration of a tick [ns]
METADATA = "tvist"  # name of the metadata written first: `format`, and `info` and `start` as JSON
END_METADATA = "tvist.end"
"""Name of the metadata written last: for each channel, how many messages were dropped."""
BEHAVIOUR = "behaviour"
"""Entry of the metadata `tvist`: number of the robot's behaviour, see `THIS_BEHAVIOUR`; 1 if missing."""
THIS_BEHAVIOUR = 7
"""Number of the present behaviour. It rises with every deliberate change of the bits that a robot computes:

1: recordings without this number.
2: the arm, the line and the shapers are computed by compiled functions, which add in another order.
5: `auto-target` uses zero-vibration shapers at a known end.
7: all kinematics of the rigid arm come from one chain of links; singular arms find nearer postures.
"""
FROM_TICK = "from_tick"
"""Entry of the metadata `tvist` in every segment of a recording but the first: number of its first tick."""

_SEGMENT = re.compile(r"(.+)-(\d+)-part(\d+)(\.[^.]*)?", re.DOTALL)

_Some = TypeVar("_Some", bound=Recorded)
_ENCODER = msgspec.json.Encoder()


def segment_name(name: str, run: int, number: int | None) -> str:
    """Return a segment's name, `run-2-part0001.mcap` for `run.mcap`; without `number`, the run's pattern."""
    path = PurePath(name)
    if number is None:
        return f"{escape(path.stem)}-{run}-part*{escape(path.suffix)}"
    return f"{path.stem}-{run}-part{number:04}{path.suffix}"


def segment_of(name: str) -> tuple[str, int, int] | None:
    """Return recording, run and number from a segment's file name; None if the file is not a segment."""
    found = _SEGMENT.fullmatch(name)
    if found is None:
        return None
    stem, run, number, ending = found.groups("")
    segment = stem + ending, int(run), int(number)
    return segment if segment_name(*segment) == name else None


def topics(robot: str) -> dict[type[msgspec.Struct], str]:
    """Return the topic of each kind of message; raise ProtocolError if the robot's name is not allowed in a key."""
    return {
        State: keys.key(robot, "state"),
        Event: keys.key(robot, "event"),
        Truth: keys.key(robot, "truth"),
        Io: keys.key(robot, "io"),
        Entry: f"{keys.PREFIX}/{robot}/{tag(Entry)}",
    }


def to_json(message: Recorded) -> bytes:
    """Encode a message; finite floats are restored bit for bit. TypeError if JSON lacks a value's type."""
    content: dict[str, Any] = {"type": tag(type(message))}
    for name in message.__struct_fields__:
        value = getattr(message, name)
        if value is not None:
            content[name] = value
    return _ENCODER.encode(content)


class JsonReader(Generic[_Some]):
    """Reads recorded messages of one type."""

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
        """Decode a message; non-finite numbers become NaN. ProtocolError if the message has another type."""
        try:
            try:
                # Add null for omitted fields; if a key occurs twice, msgspec keeps the later one, from the data.
                return self._decoder.decode(self._before + data[1:] if self._before else data)
            except msgspec.ValidationError:
                return msgspec.convert(self._with_nan(data), self._kind)
        except ValueError as error:
            why = f"a recorded message is not a valid {tag(self._kind)}: {short(str(error))}"
            raise ProtocolError("malformed", "", why) from error

    def _with_nan(self, data: bytes) -> Any:
        written = msgspec.json.decode(data)
        if not isinstance(written, dict):
            return written
        return self._absent | {name: _nan_for_null(value) for name, value in written.items()}


def viewer_schema(kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the JSON Schema of a recorded message for viewers: one `type` per field, no null, no references."""
    schema = json_schema(kind)
    shared = schema.pop("$defs", {})
    parts: Mapping[str, dict[str, Any]] = schema["properties"]
    null = {"type": "null"}
    required = [name for name in schema["required"] if null not in parts[name].get("anyOf", ())]
    properties = {name: _plain(part, shared) for name, part in parts.items()}
    return schema | {"properties": properties, "required": required}


def _plain(part: dict[str, Any], shared: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    kept = {name: value for name, value in part.items() if name not in ("anyOf", "default")}
    if "anyOf" in part:
        (choice,) = (choice for choice in part["anyOf"] if choice != {"type": "null"})
        kept = choice | kept
    if (reference := kept.pop("$ref", None)) is not None:
        struct = shared[reference.removeprefix("#/$defs/")]
        properties = {name: _plain(inner, shared) for name, inner in struct["properties"].items()}
        kept = struct | kept | {"properties": properties}
    if entries := kept.pop("prefixItems", None):
        kept["items"] = {"type": entries[0]["type"]}
    return kept if "type" in kept else {"type": "string"} | kept


def _nan_for_null(value: Any) -> Any:
    if isinstance(value, list):
        return [math.nan if entry is None else entry for entry in value]
    return math.nan if value is None else value

"""Unit and meaning of columns, and the JSON description in exported files, which also holds events, info and notes."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import msgspec

from tvist_lab.recordings.checks import GYROSCOPE
from tvist_lab.recordings.recording import TRUTH_PREFIX, Floats, Recording
from tvist_plant.user_file import UserFileError, check_is_file
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.schema import field_docs
from tvist_protocol.stream import Event, State, Truth

_UNIT = re.compile(r"\s*\[([^\]]*)\]")
KEY = "tvist"  # name of the description in a file with named parts
FORMAT = 1


@dataclass(frozen=True)
class ColumnMeaning:
    """What a column contains."""

    meaning: str  # a phrase; empty for an unknown column
    units: tuple[str, ...] = ()
    """SI unit of the column, or one per half of a vector of six; "-" for a ratio; empty without a unit."""
    whole: bool = False

    @property
    def unit(self) -> str:
        """The unit or units as text, such as `m, rad` for a pose."""
        return ", ".join(self.units)


@cache
def meaning_of(column: str) -> ColumnMeaning:
    """Describe a column: a field of `state`, of `truth` (with its prefix) or of `io`, or RTDE's variable."""
    from tvist_server.gateways.ur.rtde.table import describe

    if column == GYROSCOPE:
        return ColumnMeaning("Angular velocity of the tool, in the axes of its sensor", ("rad/s",))
    if column.startswith(TRUTH_PREFIX):
        return _of_fields(Truth).get(column.removeprefix(TRUTH_PREFIX), ColumnMeaning(""))
    own = _of_fields(State).get(column) or _of_fields(Io).get(column)
    return own or _described(describe(column), whole=False)


@cache
def _of_fields(kind: type[msgspec.Struct]) -> dict[str, ColumnMeaning]:
    docs = field_docs(kind)
    whole = (int, bool, int | None, list[int])
    return {
        field.name: _described(docs[field.name], field.type in whole)
        for field in msgspec.structs.fields(kind)
    }


def _described(text: str, whole: bool) -> ColumnMeaning:
    """Split a description into words and the units in its brackets; `[N, N m]` are two."""
    every = (unit for found in _UNIT.findall(text) for unit in found.split(", "))
    units = [unit for unit in every if not unit.startswith("by ")]
    return ColumnMeaning(_UNIT.sub("", text).rstrip(".").strip(), tuple(units), whole)


class ColumnDescription(msgspec.Struct, frozen=True):
    """Description of one column."""

    width: Annotated[int, msgspec.Meta(ge=0, le=100_000)] | None
    """Number of entries in a row; null for a number."""
    unit: str
    meaning: str


class Description(msgspec.Struct, frozen=True):
    """A recording without its arrays."""

    format: int
    columns: dict[str, ColumnDescription]
    events: list[Event] = []  # events in the order of their ticks
    info: Info | None = None
    notes: list[str] = []  # notes on what was left out when the recording was read
    foreign: bool = False  # whether another controller was recorded

    def recording(self, names: Sequence[str], values: Floats) -> Recording | None:
        """Return the recording of a table, shape (T, columns); None if it has other columns than described."""
        places, columns = {name: at for at, name in enumerate(names)}, dict[str, Floats]()
        for name, about in self.columns.items():
            flat = flat_names(name, about.width)
            if not places.keys() >= set(flat):
                return None
            found = values[:, [places.pop(one) for one in flat]]
            columns[name] = found[:, 0] if about.width is None else found
        if places:
            return None
        return Recording(columns, tuple(self.events), self.info, tuple(self.notes), foreign=self.foreign)


def flat_names(name: str, width: int | None) -> list[str]:
    """Return the names of a column's entries in a table; `width` is None for a column of numbers."""
    return [name] if width is None else [f"{name}_{index}" for index in range(width)]


def width_of(values: Floats) -> int | None:
    """Return the number of entries in a row of a column; None for a column of numbers."""
    return None if values.ndim == 1 else values.shape[1]


def ordered(recording: Recording) -> dict[str, Floats]:
    """Return the columns with `timestamp` first, if there is one."""
    columns = dict(recording.columns)
    return ({"timestamp": columns.pop("timestamp")} if "timestamp" in columns else {}) | columns


def describe(recording: Recording) -> bytes:
    """Return the description of a recording as JSON in ASCII."""
    columns = {
        name: ColumnDescription(width_of(values), meaning_of(name).unit, meaning_of(name).meaning)
        for name, values in ordered(recording).items()
    }
    described = Description(
        FORMAT, columns, list(recording.events), recording.info, list(recording.notes), recording.foreign
    )
    return json.dumps(msgspec.to_builtins(described)).encode()


def sidecar(path: Path) -> Path:
    """Return the file that describes a CSV, named as in the W3C's "CSV on the Web"."""
    return path.with_name(f"{path.name}-metadata.json")


def beside(path: Path) -> Description | None:
    """Read the description beside a CSV, if there is one."""
    try:
        check_is_file(sidecar(path), "description")
        (note, *_) = parse_json(sidecar(path).read_bytes())["notes"]
        return described(json.dumps(note[KEY]).encode())
    except (OSError, ProtocolError, UserFileError, LookupError, TypeError, ValueError):
        return None


def described(text: bytes) -> Description | None:
    """Read a description from JSON; None if it is invalid, or of a later version."""
    try:
        found = checked(parse_json(text), Description)
    except ProtocolError:
        return None
    return found if found.format == FORMAT else None

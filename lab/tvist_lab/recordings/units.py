"""Unit and meaning of each column of a recording, as the messages and RTDE's variables describe them."""

import re
from dataclasses import dataclass
from functools import cache

import msgspec

from tvist_lab.recordings.recording import TRUTH_PREFIX
from tvist_protocol.io import Io
from tvist_protocol.schema import field_docs
from tvist_protocol.stream import State, Truth

_UNIT = re.compile(r"\s*\[([^\]]*)\]")


@dataclass(frozen=True)
class ColumnMeaning:
    """What a column contains."""

    meaning: str
    """A phrase; empty for an unknown column."""
    units: tuple[str, ...] = ()
    """Its unit, or one unit for each half of a vector of six (SI); "-" for a ratio; empty without a unit."""
    whole: bool = False
    """Whether its values are whole numbers."""

    def unit(self) -> str:
        """Return the unit or units as text, such as `m, rad` for a pose."""
        return ", ".join(self.units)

    def unit_of_entry(self, index: int, width: int) -> str:
        """Return the unit of one entry of a vector of `width` entries."""
        if not self.units:
            return ""
        return self.units[index * len(self.units) // width]


@cache
def meaning_of(column: str) -> ColumnMeaning:
    """Describe a column of a recording: a field of `state`, `truth` (with its prefix) or `io`, or RTDE's variable."""
    if column.startswith(TRUTH_PREFIX):
        return _of_fields(Truth).get(column.removeprefix(TRUTH_PREFIX), ColumnMeaning(""))
    return _of_fields(State).get(column) or _of_fields(Io).get(column) or _of_rtde(column)


@cache
def _of_fields(kind: type[msgspec.Struct]) -> dict[str, ColumnMeaning]:
    docs = field_docs(kind)
    whole = (int, bool, int | None, list[int])
    return {
        field.name: _described(docs[field.name], field.type in whole)
        for field in msgspec.structs.fields(kind)
    }


def _of_rtde(column: str) -> ColumnMeaning:
    from tvist_server.gateways.ur.rtde.table import describe

    try:
        _, what = describe(column)
    except (AttributeError, ValueError):
        return ColumnMeaning("")
    return _described(what, whole=False)


def _described(text: str, whole: bool) -> ColumnMeaning:
    """Split a description into words and the units in its brackets; `[N, N m]` are two."""
    units = [
        unit for found in _UNIT.findall(text) for unit in found.split(", ") if not unit.startswith("by ")
    ]
    return ColumnMeaning(_UNIT.sub("", text).rstrip(".").strip(), tuple(units), whole)

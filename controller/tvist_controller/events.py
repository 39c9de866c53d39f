"""Events for clients, and counters."""

from dataclasses import dataclass
from typing import Protocol, TypedDict, Unpack

from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind, PopupKind


class StopFields(TypedDict, total=False):
    """Fields of a stop's event; see `tvist_protocol.stream.Event`."""

    category: int | None
    duration: float | None
    way: float | None


class Fields(StopFields, total=False):
    """Fields of an event other than its kind; see `tvist_protocol.stream.Event`."""

    id: int | None
    code: Code | None
    why: str | None
    line: int | None
    column: int | None
    program: str | None
    title: str | None
    level: PopupKind | None
    blocking: bool | None
    secondary: bool | None


class Emit(Protocol):
    """Function that emits an event."""

    def __call__(self, kind: EventKind, **fields: Unpack[Fields]) -> None:
        """Emit an event of the present tick, or of the next one if called between ticks."""


@dataclass
class Counters:
    """Counts since the start."""

    commands: int = 0
    refused: int = 0
    setpoints_received: int = 0
    setpoints_refused: int = 0
    missed_ticks: int = 0

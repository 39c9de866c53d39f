"""What happens, on its way to who tells of it."""

from typing import Protocol, TypedDict, Unpack

from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind


class Told(TypedDict, total=False):
    """What the event of a stop says of it; see `tvist_protocol.stream.Event`."""

    category: int | None
    duration: float | None
    way: float | None


class Fields(Told, total=False):
    """What an event may say besides its kind; see `tvist_protocol.stream.Event`."""

    id: int | None
    code: Code | None
    why: str | None
    line: int | None


class Emit(Protocol):
    """Puts down an event."""

    def __call__(self, kind: EventKind, **fields: Unpack[Fields]) -> None:
        """Emit an event of the tick that is being computed, or of the next one between two ticks."""

"""What happens, on its way to who tells of it."""

from typing import Protocol, TypedDict

from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind


class Emit(Protocol):
    """Puts down an event."""

    def __call__(
        self,
        kind: EventKind,
        *,
        id: int | None = None,  # noqa: A002  the wire's name
        code: Code | None = None,
        why: str | None = None,
        category: int | None = None,
        duration: float | None = None,
        way: float | None = None,
    ) -> None:
        """Of the tick that is being made, or of the next one between two."""


class Told(TypedDict):
    """What the event of a stop says of it."""

    category: int | None
    duration: float | None
    way: float | None


NO_STOP = Told(category=None, duration=None, way=None)
"""Of an end that is no stop."""

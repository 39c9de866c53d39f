"""Journal of all inputs of a controller; with the initial setup it determines a run. Recordings contain it."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.lessons import PayloadLesson

EntryKind = Literal[
    "command", "setpoint", "setpoint_refused", "client_seen", "client_gone", "missed", "socket", "gripper", "lesson",
]  # fmt: skip
SocketChange = Literal["opened", "failed", "received", "closed", "expired"]
"""What happened to a program's socket: it was opened or could not be, has received bytes, or was closed by
the peer; or a wait for it has expired in wall time."""


class Entry(Struct, frozen=True, kw_only=True, tag_field="type", tag="journal"):
    """One input that reached the controller before a tick was computed; entries are in order."""

    tick: int
    """Number of the first control period computed after it."""
    kind: EntryKind
    """Kind of entry: a message, an unreadable set-point of the lease's holder, the end of the session that
    had control or the clock, ticks that started too late, an event of a program's socket, a request to the
    cell's gripper that changes it, or something that the robot has learnt. Recordings made before sessions
    were distinguished contain every liveliness token that appeared or disappeared."""
    client: str | None = None
    """Client that it came from or concerns, if known."""
    session: str | None = None
    """Session that got control or the clock, or has ended; empty if the client's liveliness token does not name it."""
    message: Annotated[dict[str, Any], Meta(extra_json_schema={"properties": {}})] | None = None
    """Decoded message, for a command or a set-point; for a lesson, the lesson."""
    count: int | None = None
    """Number of ticks that started too late."""
    why: str | None = None
    """Reason why a set-point could not be read; the event of a stream that stops may repeat it."""
    socket: int | None = None
    """Number of the socket, or of the wait that has expired."""
    change: SocketChange | None = None
    """What happened to the socket."""
    data: bytes | None = None
    """Bytes that the socket or the gripper has received."""


def entry_of(tick: int, message: Command | Setpoint, client: str | None = None) -> Entry:
    """Return the journal's entry for a message."""
    kind: EntryKind = "setpoint" if type(message) is Setpoint else "command"
    return Entry(tick=tick, kind=kind, client=client, message=msgspec.to_builtins(message))


def lesson_of(entry: Entry) -> PayloadLesson:
    """Return the lesson of an entry; raise ProtocolError if it is invalid."""
    lesson: PayloadLesson = _content(entry, PayloadLesson)
    return lesson


def message_of(entry: Entry) -> Command | Setpoint:
    """Return the message of an entry, equal to the original one; raise ProtocolError if it is invalid."""
    message: Command | Setpoint = _content(entry, Setpoint if entry.kind == "setpoint" else Command)
    return message


def _content(entry: Entry, kind: Any) -> Any:
    where = f"the journal's {entry.kind} before tick {entry.tick}"
    if entry.message is None:
        raise ProtocolError("missing_field", "message", f"{where} has no message")
    try:
        return checked(entry.message, kind)
    except ProtocolError as error:
        raise ProtocolError("malformed", "message", f"{where} is not valid: {error.why}") from error

"""What reached a controller, tick by tick: with how it started, all that an equal run needs.

A journal never crosses the network; it stands in a recording, beside what the robot put.
"""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import explain_content

EntryKind = Literal["command", "setpoint", "setpoint_refused", "client_seen", "client_gone", "missed"]


class Entry(Struct, frozen=True, kw_only=True, tag_field="type", tag="journal"):
    """One thing that reached the controller before a tick was computed; entries stand in order."""

    tick: int
    """Number of the first control period computed after it."""
    kind: EntryKind
    """What it was: a message, a set-point of the lease's holder that could not be read, the end of the session that had
    control or the clock, or ticks that began too late. Recordings made before sessions were told apart have every
    liveliness token that came or went."""
    client: str | None = None
    """Client it came from or is about, where that is known."""
    session: str | None = None
    """Session of who got control or the clock, or has gone; empty where the client's liveliness token does not say."""
    message: Annotated[dict[str, Any], Meta(extra_json_schema={"properties": {}})] | None = None
    """The message as it was decoded, for a command or a set-point."""
    count: int | None = None
    """How many ticks began too late."""
    why: str | None = None
    """Why a set-point could not be read: it may stand in the event that says that none came."""


def entry_of(tick: int, message: Command | Setpoint, client: str | None = None) -> Entry:
    """Entry of a message.

    Args:
        tick: Number of the first control period computed after it.
        message: As it was decoded.
        client: Who sent it, where that is known.
    """
    kind: EntryKind = "setpoint" if type(message) is Setpoint else "command"
    return Entry(tick=tick, kind=kind, client=client, message=msgspec.to_builtins(message))


def message_of(entry: Entry) -> Command | Setpoint:
    """The message of an entry, equal to the one it was made of.

    Raises:
        ProtocolError: The entry is none of a message, or what it holds is no valid one.
    """
    where = f"the journal's {entry.kind} before tick {entry.tick}"
    if entry.message is None:
        raise ProtocolError("missing_field", "message", f"{where} has no message")
    try:
        if entry.kind == "setpoint":
            return msgspec.convert(entry.message, Setpoint)
        command: Command = msgspec.convert(entry.message, Command)
    except msgspec.ValidationError as error:
        kind = Setpoint if entry.kind == "setpoint" else Command
        fault = explain_content(error, entry.message, kind)
        raise ProtocolError("malformed", "message", f"{where} is no valid message: {fault.why}") from error
    return command

"""Table of a robot's keys and their messages, for generated documents and tests."""

from dataclasses import dataclass
from typing import Literal, get_args

from msgspec import Struct

from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth


@dataclass(frozen=True, slots=True)
class Channel:
    """One key."""

    key: str  # with `{robot}` and `{client}` as placeholders of names
    kind: Literal["put", "queryable", "liveliness"]
    by: Literal["server", "client"]  # side that puts messages, sends queries or declares tokens
    messages: tuple[type[Struct], ...]  # types that are put or asked
    answers: tuple[type[Struct], ...]
    meaning: str  # description for the documents


COMMANDS: tuple[type[Struct], ...] = get_args(Command)
REPLIES: tuple[type[Struct], ...] = get_args(Reply)
STREAMS: tuple[type[Struct], ...] = (State, Event, Truth, Telemetry, Io)
MESSAGES: tuple[type[Struct], ...] = (*COMMANDS, Setpoint, *REPLIES, *STREAMS, Info)
"""Every message of the protocol."""

CHANNELS = (
    Channel("tvist/{robot}/state", "put", "server", (State,), (),
        "state of controller and arm, 500 Hz; dropped rather than sent late in real time, never in lockstep"),
    Channel("tvist/{robot}/truth", "put", "server", (Truth,), (),
        "values that a real robot cannot measure, 500 Hz; only with `serve --truth`"),
    Channel("tvist/{robot}/event", "put", "server", (Event,), (), "an event, with its tick"),
    Channel("tvist/{robot}/telemetry", "put", "server", (Telemetry,), (),
        "timing and counters of the server, 1 Hz"),
    Channel("tvist/{robot}/io", "put", "server", (Io,), (),
        "inputs, outputs, registers and tool; sent before the state of a tick with a change, and at 1 Hz"),
    Channel("tvist/{robot}/command", "queryable", "client", COMMANDS, REPLIES,
        "a command as the query's payload; always answered"),
    Channel("tvist/{robot}/setpoint", "put", "client", (Setpoint,), (),
        "a stream of set-points; errors are counted, not answered"),
    Channel("tvist/{robot}/info", "queryable", "client", (), (Info, Refused),
        "description and current settings of the robot, `refused` while it starts; the query has no payload"),
    Channel("tvist/{robot}/alive", "liveliness", "server", (), (),
        "exists from when the robot is ready until its server ends"),
    Channel("tvist/{robot}/client/{client}", "liveliness", "client", (), (),
        "optional; if it exists when control is taken, the lease ends at once when it disappears. "
        "`/<session>`, Zenoh's id of the client's session, may follow, to distinguish "
        "clients of the same name"),
)  # fmt: skip


def tag(message: type[Struct]) -> str:
    """Return the value of a message's field `type`."""
    return str(message.__struct_config__.tag)

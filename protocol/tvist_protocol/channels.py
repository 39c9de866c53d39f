"""Which message goes where: the keys of a robot as a table, for the documents made from it and for tests."""

from dataclasses import dataclass
from typing import Literal, get_args

from msgspec import Struct

from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One key.

    Attributes:
        name: Short name.
        key: The key, with `{robot}` and `{client}` where names go.
        kind: `put`, a queryable, or a liveliness token.
        by: Who puts, asks or holds.
        messages: Types of what is put or asked.
        answers: Types of what is answered.
        meaning: A sentence.
    """

    name: str
    key: str
    kind: Literal["put", "queryable", "liveliness"]
    by: Literal["server", "client"]
    messages: tuple[type[Struct], ...] = ()
    answers: tuple[type[Struct], ...] = ()
    meaning: str


COMMANDS: tuple[type[Struct], ...] = get_args(Command)
REPLIES: tuple[type[Struct], ...] = get_args(Reply)
STREAMS: tuple[type[Struct], ...] = (State, Event, Truth, Telemetry, Io)
MESSAGES: tuple[type[Struct], ...] = (*COMMANDS, Setpoint, *REPLIES, *STREAMS, Info)
"""Every message there is."""

CHANNELS = (
    Channel(
        name="state",
        key="tvist/{robot}/state",
        kind="put",
        by="server",
        messages=(State,),
        meaning="controller and arm, 500 Hz: dropped rather than late in real time, never in lockstep",
    ),
    Channel(
        name="truth",
        key="tvist/{robot}/truth",
        kind="put",
        by="server",
        messages=(Truth,),
        meaning="what no robot can know, 500 Hz; only when `serve --truth`",
    ),
    Channel(
        name="event",
        key="tvist/{robot}/event",
        kind="put",
        by="server",
        messages=(Event,),
        meaning="what happened, at its tick",
    ),
    Channel(
        name="telemetry",
        key="tvist/{robot}/telemetry",
        kind="put",
        by="server",
        messages=(Telemetry,),
        meaning="how the server is doing, 1 Hz",
    ),
    Channel(
        name="io",
        key="tvist/{robot}/io",
        kind="put",
        by="server",
        messages=(Io,),
        meaning="inputs, outputs, registers and tool: before the state of the tick that has a change, and 1 Hz",
    ),
    Channel(
        name="command",
        key="tvist/{robot}/command",
        kind="queryable",
        by="client",
        messages=COMMANDS,
        answers=REPLIES,
        meaning="a command as the query's payload; always answered",
    ),
    Channel(
        name="setpoint",
        key="tvist/{robot}/setpoint",
        kind="put",
        by="client",
        messages=(Setpoint,),
        meaning="a stream of set-points; what is wrong with one is counted, not answered",
    ),
    Channel(
        name="info",
        key="tvist/{robot}/info",
        kind="queryable",
        by="client",
        answers=(Info,),
        meaning="what the robot is and how it is set up; the query has no payload",
    ),
    Channel(
        name="alive",
        key="tvist/{robot}/alive",
        kind="liveliness",
        by="server",
        meaning="there as long as the server is",
    ),
    Channel(
        name="client",
        key="tvist/{robot}/client/{client}",
        kind="liveliness",
        by="client",
        meaning="optional; where it is there when control is taken, its going ends the lease at once. "
        "`/<session>`, Zenoh's id of the client's session, may follow: it tells the client from another of that name",
    ),
)


def tag(message: type[Struct]) -> str:
    """What a message's field `type` says."""
    return str(message.__struct_config__.tag)

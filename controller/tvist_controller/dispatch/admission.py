"""Checks of messages in any thread: valid content, and a sender with the right to send it at this moment."""

import contextlib
from typing import Any, NamedTuple

import msgspec

from tvist_controller.dispatch.rights import (
    CLOCK,
    Lease,
    check_free,
    check_step,
    check_step_token,
    check_token,
    is_holders,
)
from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.motion.setpoints import Unreadable
from tvist_controller.refusal import RefusalError
from tvist_protocol.channels import tag
from tvist_protocol.codec import Envelope, decode, decode_command, decode_envelope, refusal
from tvist_protocol.commands import Command, ReleaseClock, Setpoint, TakeClock, TakeControl
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationStep

STEP = tag(SimulationStep)
LONG = frozenset(tag(row.message) for row in COMMANDS.values() if row.long)
"""Types of commands that may exceed `EXPLAINED_BYTES`."""


class Admitted(NamedTuple):
    """A command that passed the checks."""

    command: Command
    content: dict[str, Any]  # content as built-in types, for the journal
    session: str | None = None
    """Session of a client that gets control or the clock, if `client_gone` will report its end."""
    client: str | None = None  # sending client, from its token or the command; None if unknown
    origin: str | None = None  # IP address of the sender; None if unknown


def admit(data: bytes, lease: Lease | None, clock: Lease | None = None) -> Admitted | Refused:
    """Decode a command and check its sender's rights; check the token of a long command before decoding."""
    try:
        if len(data) > EXPLAINED_BYTES:
            _check_envelope(decode_envelope(data), len(data), lease, clock)
        return admit_command(decode_command(data), lease, clock)
    except ProtocolError as error:
        return refusal(error)
    except RefusalError as error:
        return error.reply


def admit_command(command: Command, lease: Lease | None, clock: Lease | None = None) -> Admitted | Refused:
    """Check the rights of a command's sender."""
    try:
        client = _authorize(command, lease, clock)
    except RefusalError as error:
        return error.reply
    return Admitted(command, msgspec.to_builtins(command), client=client)


def admit_setpoint(data: bytes, lease: Lease | None) -> Setpoint | Unreadable | None:
    """Decode a set-point; return None unless its token is that of `lease`. The controller checks it again."""
    if lease is None or len(data) > EXPLAINED_BYTES:
        return None
    setpoint: Setpoint | Unreadable
    try:
        setpoint = decode(Setpoint, data)
    except ProtocolError as error:
        token = None
        with contextlib.suppress(ProtocolError):
            token = decode_envelope(data).token
        setpoint = Unreadable(token, error.why)
    return setpoint if is_holders(lease, setpoint.token) else None


def _authorize(command: Command, lease: Lease | None, clock: Lease | None) -> str | None:
    """Check the rights of a command's sender; return its name, if known."""
    match command:
        case TakeControl():
            check_free(lease, command.client)
            return command.client
        case TakeClock():
            check_free(clock, command.client, CLOCK)
            return command.client
        case ReleaseClock():
            return check_token(clock, command.token, words=CLOCK).client
        case SimulationStep():
            return check_step(clock, lease, command)
    token = getattr(command, "token", None)
    return None if token is None else check_token(lease, token).client


def _check_envelope(envelope: Envelope, size: int, lease: Lease | None, clock: Lease | None) -> None:
    if envelope.type not in LONG:
        of = "message" if envelope.type is None else f"{envelope.type:.40}"
        why = f"the {of} has {size} bytes: must be at most {EXPLAINED_BYTES}"
        raise ProtocolError("malformed", "", why, EXPLAINED_BYTES)
    if envelope.token is None:
        raise ProtocolError("missing_field", "token", "token is missing")
    if envelope.type == STEP:
        check_step_token(clock, lease, envelope.token)
    else:
        check_token(lease, envelope.token)

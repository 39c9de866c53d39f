"""Checks that a message must pass before the controller gets it: it is valid, and its sender may send it.

Nothing here changes any state, so messages can be admitted in any thread. A message that is admitted long before it
is carried out has to be checked again, since the lease may have changed.
"""

import contextlib
from typing import Any, NamedTuple

import msgspec

from tvist_controller.dispatch.rights import (
    CLOCK,
    Lease,
    NoControlError,
    check_free,
    check_step,
    check_step_token,
    check_token,
    is_holders,
)
from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.motion.setpoints import Unreadable
from tvist_protocol.channels import tag
from tvist_protocol.codec import Envelope, decode, decode_command, decode_envelope, refusal
from tvist_protocol.commands import Command, ReleaseClock, Setpoint, TakeClock, TakeControl
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationStep

STEP = tag(SimulationStep)
LONG = frozenset(tag(row.message) for row in COMMANDS.values() if row.long)
"""Types of commands that may be longer than `EXPLAINED_BYTES`."""


class Admitted(NamedTuple):
    """A command that has passed the checks."""

    command: Command
    content: dict[str, Any]
    """Content as Python's built-in types, for the journal."""
    session: str | None = None
    """Session of the client that the command gives control or the clock to, if `client_gone` will report its end."""
    client: str | None = None
    """Client that sent it, from its token or the name in the command; None if it has neither."""
    origin: str | None = None
    """IP address of the machine that sent it; None if the network does not tell."""


def admit(data: bytes, lease: Lease | None, clock: Lease | None = None) -> Admitted | Refused:
    """Decode a command, and check that its sender may send it.

    Of a long command only the type and token are decoded until its sender is known to have control or the clock.
    """
    try:
        if len(data) > EXPLAINED_BYTES:
            _check_envelope(decode_envelope(data), len(data), lease, clock)
        return admit_command(decode_command(data), lease, clock)
    except ProtocolError as error:
        return refusal(error)
    except NoControlError as error:
        return error.reply


def admit_command(command: Command, lease: Lease | None, clock: Lease | None = None) -> Admitted | Refused:
    """Check that the sender of a command may send it."""
    try:
        client = _authorize(command, lease, clock)
    except NoControlError as error:
        return error.reply
    return Admitted(command, msgspec.to_builtins(command), client=client)


def admit_setpoint(data: bytes, lease: Lease | None) -> Setpoint | Unreadable | None:
    """Decode a set-point; return None if its sender is not known to have control, to spare the controller's thread.

    Whose it is decides the lease at the moment at which it is carried out.
    """
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
    """Check that a command's sender may send it; return the sender's name, if the command contains it."""
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
        why = f"the {of} has {size} bytes, at most {EXPLAINED_BYTES} are allowed"
        raise ProtocolError("malformed", "", why, EXPLAINED_BYTES)
    if envelope.token is None:
        raise ProtocolError("missing_field", "token", "token is missing")
    if envelope.type == STEP:
        check_step_token(clock, lease, envelope.token)
    else:
        check_token(lease, envelope.token)

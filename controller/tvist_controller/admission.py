"""What a message must pass before the controller sees it: it is sound, and its sender may send it.

Nothing here changes anything, so that messages can be admitted in any thread. Whoever admits one long before it is
carried out has it checked twice: the lease may have changed.
"""

import contextlib
from typing import Any, NamedTuple

import msgspec

from tvist_controller.session import Lease, NoControlError, check_free, check_token
from tvist_controller.stepping import (
    ClockHold,
    check_clock_free,
    check_clock_token,
    check_step,
    check_step_token,
)
from tvist_protocol.channels import tag
from tvist_protocol.codec import Envelope, decode_command, decode_envelope, decode_setpoint, refusal
from tvist_protocol.commands import Command, ReleaseClock, SetEstimator, Setpoint, TakeClock, TakeControl
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationStep

STEP = tag(SimulationStep)
LONG = frozenset((tag(SetEstimator), STEP))
"""Types of commands that may have more than `EXPLAINED_BYTES`."""


class Admitted(NamedTuple):
    """A command that may be carried out."""

    command: Command
    content: dict[str, Any]
    """Content in Python's own types, for the journal."""
    session: str | None = None
    """Session of the client that it gives control or the clock to, where its going will be told."""
    client: str | None = None
    """Client that sent it, by its token or the name in it; None if it has neither."""


def admit(data: bytes, lease: Lease | None, clock: ClockHold | None = None) -> Admitted | Refused:
    """Read a command, and check that its sender may send it.

    Of a long one nothing is read but type and token before its sender is known to have control or the clock.

    Args:
        data: The message.
        lease: Lease that gives control.
        clock: Current hold of the clock.
    """
    try:
        if len(data) > EXPLAINED_BYTES:
            _check_envelope(decode_envelope(data), len(data), lease, clock)
        command = decode_command(data)
    except ProtocolError as error:
        return refusal(error)
    except NoControlError as error:
        return error.reply
    return admit_command(command, lease, clock)


def admit_command(
    command: Command, lease: Lease | None, clock: ClockHold | None = None
) -> Admitted | Refused:
    """Check that whoever sends a command may send it.

    Args:
        command: The command.
        lease: Lease that gives control.
        clock: Current hold of the clock.
    """
    try:
        client = _authorize(command, lease, clock)
    except NoControlError as error:
        return error.reply
    return Admitted(command, msgspec.to_builtins(command), client=client)


class Unreadable(NamedTuple):
    """A set-point that cannot be read, of the client that has control."""

    token: str
    why: str
    """A sentence with field, value and limit."""


def admit_setpoint(data: bytes, lease: Lease | None) -> Setpoint | Unreadable | None:
    """Read a set-point; None where its sender has no control, or nothing says that it has.

    Args:
        data: The message.
        lease: Lease that gives control.
    """
    if lease is None or len(data) > EXPLAINED_BYTES:
        return None
    try:
        setpoint = decode_setpoint(data)
    except ProtocolError as error:
        return Unreadable(lease.token, error.why) if _token(data) == lease.token else None
    return setpoint if setpoint.token == lease.token else None


def _token(data: bytes) -> str | None:
    """Token of a message that cannot be read, as far as it has one."""
    with contextlib.suppress(ProtocolError):
        return decode_envelope(data).token
    return None


def _authorize(command: Command, lease: Lease | None, clock: ClockHold | None) -> str | None:
    """Check that a command's sender may send it; the sender's name, as far as the command says it."""
    match command:
        case TakeControl():
            check_free(lease, command.client)
            return command.client
        case TakeClock():
            check_clock_free(clock, command.client)
            return command.client
        case ReleaseClock():
            return check_clock_token(clock, command.token).client
        case SimulationStep():
            return check_step(clock, lease, command)
    token = getattr(command, "token", None)
    return None if token is None else check_token(lease, token).client


def _check_envelope(envelope: Envelope, size: int, lease: Lease | None, clock: ClockHold | None) -> None:
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

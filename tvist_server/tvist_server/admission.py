"""What a message must pass before the controller sees it: it is sound, and its sender may send it.

Nothing here changes anything, so that messages can be admitted in any thread. Whoever admits one long before it is
carried out has it checked twice: the lease may have changed.
"""

import contextlib
from typing import Any, NamedTuple

import msgspec

from tvist_protocol.channels import tag
from tvist_protocol.codec import Envelope, decode_command, decode_envelope, decode_setpoint, refusal
from tvist_protocol.commands import Command, SetEstimator, Setpoint, SimulationStep, TakeControl
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Refused
from tvist_server.session import Lease, NoControlError, check_free, check_token

LONG = frozenset(tag(kind) for kind in (SetEstimator, SimulationStep))
"""Types of commands that may have more than `EXPLAINED_BYTES`."""


class Admitted(NamedTuple):
    """A command that may be carried out."""

    command: Command
    content: dict[str, Any]
    """The same in Python's own types, for the journal."""
    session: str | None = None
    """Session of the client that it gives control to, where its going will be told."""


def admit(data: bytes, lease: Lease | None) -> Admitted | Refused:
    """Read a command, and check that its sender may send it.

    Of a long one nothing is read but type and token before its sender is known to have control.

    Args:
        data: The message.
        lease: Who has control.
    """
    try:
        if len(data) > EXPLAINED_BYTES:
            _check_envelope(decode_envelope(data), len(data), lease)
        command = decode_command(data)
    except ProtocolError as error:
        return refusal(error)
    except NoControlError as error:
        return error.reply
    return admit_command(command, lease)


def admit_command(command: Command, lease: Lease | None) -> Admitted | Refused:
    """Check that whoever sends a command may send it.

    Args:
        command: The command.
        lease: Who has control.
    """
    try:
        _authorize(command, lease)
    except NoControlError as error:
        return error.reply
    return Admitted(command, msgspec.to_builtins(command))


class Unreadable(NamedTuple):
    """A set-point that cannot be read, of the client that has control."""

    token: str
    why: str
    """A sentence with field, value and limit."""


def admit_setpoint(data: bytes, lease: Lease | None) -> Setpoint | Unreadable | None:
    """Read a set-point; None where its sender has no control, or nothing says that it has.

    Args:
        data: The message.
        lease: Who has control.
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


def _authorize(command: Command, lease: Lease | None) -> None:
    if isinstance(command, TakeControl):
        check_free(lease, command.client)
    else:
        token = getattr(command, "token", None)
        if token is not None:
            check_token(lease, token)


def _check_envelope(envelope: Envelope, size: int, lease: Lease | None) -> None:
    if envelope.type not in LONG:
        of = "message" if envelope.type is None else f"{envelope.type:.40}"
        why = f"the {of} has {size} bytes, at most {EXPLAINED_BYTES} are allowed"
        raise ProtocolError("malformed", "", why, EXPLAINED_BYTES)
    if envelope.token is None:
        raise ProtocolError("missing_field", "token", "token is missing")
    check_token(lease, envelope.token)

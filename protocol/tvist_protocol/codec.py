"""Bytes to messages and back: MessagePack maps, validated when they come in.

Every fault of a message is a `ProtocolError`, whatever the bytes; `refusal` makes the answer of it.
"""

from collections.abc import Mapping
from typing import Any, Generic, TypeVar, Union, get_args

import msgspec

from tvist_protocol.calibration import Calibration
from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.encodable import explain_unencodable
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import (
    EXPLAINED_BYTES,
    FAULTS,
    explain_bytes,
    explain_refusal,
    explain_unknown_type,
)
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_protocol.values import Name

Message = Command | Setpoint | Reply | State | Event | Truth | Telemetry | Io | Info

MAX_BYTES = 256 * 1024
"""Largest message. The largest useful one, a step of 1000 set-points of 7 joints, has 1000·(18 + 67) bytes;
three times that leaves room for a calibration sent as a map. 5 MB are refused before they are looked at."""

_Some = TypeVar("_Some")
_SomeMessage = TypeVar("_SomeMessage", bound=Message)


class Envelope(msgspec.Struct, frozen=True, gc=False):
    """What can be told of a message without building it: reading it takes a twentieth of decoding it, or less."""

    type: str | None = None
    """Its `type`; None where it has none."""
    token: str | None = None
    """Names the lease; None where it has none."""


class _Calibrated(msgspec.Struct, gc=False):
    """The part of a `set_estimator` that may be long."""

    calibration: Name | Calibration | None = None


class _Untyped(msgspec.Struct, tag_field="type", tag=""):
    """Second member of every union: msgspec asks for `type` only where it has a choice."""


class _Reader(Generic[_Some]):
    """Bytes to one kind of message."""

    def __init__(self, *types: type[msgspec.Struct]) -> None:
        self.types: Mapping[str, type[msgspec.Struct]] = {str(t.__struct_config__.tag): t for t in types}
        self._decoder: msgspec.msgpack.Decoder[_Some] = msgspec.msgpack.Decoder(Union[(*types, _Untyped)])

    def read(self, data: bytes) -> _Some:
        if len(data) > MAX_BYTES:
            why = f"the message has {len(data)} bytes, at most {MAX_BYTES} are allowed"
            raise ProtocolError("malformed", "", why, MAX_BYTES)
        try:
            message = self._decoder.decode(data)
        except msgspec.ValidationError as error:
            raise explain_refusal(error, data, self.types) from error
        except FAULTS as error:
            raise explain_bytes(error) from error
        if type(message) is _Untyped:
            raise explain_unknown_type("", self.types)
        return message


_ENVELOPE: msgspec.msgpack.Decoder[Envelope] = msgspec.msgpack.Decoder(Envelope)
_CALIBRATED: msgspec.msgpack.Decoder[_Calibrated] = msgspec.msgpack.Decoder(_Calibrated)
_ENCODER = msgspec.msgpack.Encoder()
_COMMAND: _Reader[Command] = _Reader(*get_args(Command))
_SETPOINT: _Reader[Setpoint] = _Reader(Setpoint)
_REPLY: _Reader[Reply] = _Reader(*get_args(Reply))
_STATE: _Reader[State] = _Reader(State)
_EVENT: _Reader[Event] = _Reader(Event)
_TRUTH: _Reader[Truth] = _Reader(Truth)
_TELEMETRY: _Reader[Telemetry] = _Reader(Telemetry)
_IO: _Reader[Io] = _Reader(Io)
_INFO: _Reader[Info] = _Reader(Info)
_READER_OF: dict[type[msgspec.Struct], _Reader[Any]] = {
    kind: reader
    for reader in (_COMMAND, _SETPOINT, _REPLY, _STATE, _EVENT, _TRUTH, _TELEMETRY, _IO, _INFO)
    for kind in reader.types.values()
}


def encode(message: Message) -> bytes:
    """Message to bytes, without validating it.

    Raises:
        ProtocolError: A field holds what MessagePack cannot, a numpy number for instance.
    """
    try:
        return _ENCODER.encode(message)
    except FAULTS as error:
        raise explain_unencodable(message, error) from error


def check(message: _SomeMessage) -> _SomeMessage:
    """Validate a message made by its constructor, exactly as the server will.

    Returns:
        The message as the server will see it: integers where numbers are meant become floats, lists tuples.

    Raises:
        ProtocolError: What the server would refuse without knowing the robot.
    """
    reader = _READER_OF.get(type(message))
    if reader is None:
        raise ProtocolError("unknown_type", "type", f"{type(message).__name__} is not a message")
    checked: _SomeMessage = reader.read(encode(message))
    return checked


def refusal(error: ProtocolError) -> Refused:
    """Answer to a command that is no valid message."""
    return Refused(code=error.code, where=error.where, why=error.why, limit=error.limit)


def decode_envelope(data: bytes) -> Envelope:
    """Type and token of a message that may be anything else but sound.

    Raises:
        ProtocolError: The message is not a map, or type or token is not a string.
    """
    try:
        return _ENVELOPE.decode(data)
    except msgspec.ValidationError as error:
        raise explain_refusal(error, data, {}) from error
    except FAULTS as error:
        raise explain_bytes(error) from error


def decode_command(data: bytes) -> Command:
    """Bytes from the command key.

    Raises:
        ProtocolError: They are no valid command; the same holds for its siblings below.
    """
    if EXPLAINED_BYTES < len(data) <= MAX_BYTES and b"set_estimator" in data:
        _refuse_long_fault(data)
    return _COMMAND.read(data)


def _refuse_long_fault(data: bytes) -> None:
    """Find the fault of a long calibration before its map is built, which may take a hundred times longer.

    Raises:
        ProtocolError: There is one.
    """
    decode_envelope(data)  # the message is sound
    try:
        _CALIBRATED.decode(data)
    except msgspec.ValidationError as error:
        raise explain_refusal(error, data, {}) from error
    except FAULTS as error:
        raise explain_bytes(error) from error


def decode_setpoint(data: bytes) -> Setpoint:
    """Bytes from the set-point key."""
    return _SETPOINT.read(data)


def decode_reply(data: bytes) -> Reply:
    """Answer to a command."""
    return _REPLY.read(data)


def decode_state(data: bytes) -> State:
    """One tick of the 500 Hz stream."""
    return _STATE.read(data)


def decode_event(data: bytes) -> Event:
    """One event."""
    return _EVENT.read(data)


def decode_truth(data: bytes) -> Truth:
    """One tick of what no robot can know."""
    return _TRUTH.read(data)


def decode_telemetry(data: bytes) -> Telemetry:
    """The server's own figures."""
    return _TELEMETRY.read(data)


def decode_io(data: bytes) -> Io:
    """Inputs, outputs and registers."""
    return _IO.read(data)


def decode_info(data: bytes) -> Info:
    """Answer to a query on the info key."""
    return _INFO.read(data)

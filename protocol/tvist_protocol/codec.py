"""Encodes, decodes and validates messages; whatever the bytes, decoding returns a message or raises ProtocolError."""

from typing import Any, Generic, TypeVar, Union, get_args

import msgspec

from tvist_protocol.calibration import Calibration
from tvist_protocol.commands import Command, Setpoint
from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import (
    EXPLAINED_BYTES,
    FAULTS,
    Types,
    explain_bytes,
    explain_refusal,
    explain_unencodable,
    explain_unknown_type,
)
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_protocol.values import Name

Message = Command | Setpoint | Reply | State | Event | Truth | Telemetry | Io | Info

MAX_BYTES = 256 * 1024
"""Largest decoded message [bytes]; steps of 1000 set-points (85 kB) and calibrations are the longest."""

_Some = TypeVar("_Some")
_SomeMessage = TypeVar("_SomeMessage", bound=Message)


class Envelope(msgspec.Struct, frozen=True, gc=False):
    """Type and token of a message; decoding them is at least twenty times as fast as decoding the whole message."""

    type: str | None = None  # the message's `type`; None if it has none
    token: str | None = None  # token of the lease; None if the message has none


class _Calibrated(msgspec.Struct, gc=False):
    """The only field of `set_estimator` that may be long."""

    calibration: Name | Calibration | None = None


class _Untyped(msgspec.Struct, tag_field="type", tag=""):
    """Added to every union: in a union of only one struct, msgspec would not require the field `type`."""


def _decoded(decoder: msgspec.msgpack.Decoder[_Some], data: bytes, types: Types) -> _Some:
    try:
        return decoder.decode(data)
    except msgspec.ValidationError as error:
        raise explain_refusal(error, data, types) from error
    except FAULTS as error:
        raise explain_bytes(error) from error


class _Reader(Generic[_Some]):
    """Decodes and validates the messages of one key."""

    def __init__(self, *types: type[msgspec.Struct]) -> None:
        self.types: Types = {str(t.__struct_config__.tag): t for t in types}
        self._decoder: msgspec.msgpack.Decoder[_Some] = msgspec.msgpack.Decoder(Union[(*types, _Untyped)])

    def read(self, data: bytes) -> _Some:
        if len(data) > MAX_BYTES:
            why = f"the message has {len(data)} bytes: must have at most {MAX_BYTES}"
            raise ProtocolError("malformed", "", why, MAX_BYTES)
        message = _decoded(self._decoder, data, self.types)
        if type(message) is _Untyped:
            raise explain_unknown_type("", self.types)
        return message


_ENVELOPE: msgspec.msgpack.Decoder[Envelope] = msgspec.msgpack.Decoder(Envelope)
_CALIBRATED: msgspec.msgpack.Decoder[_Calibrated] = msgspec.msgpack.Decoder(_Calibrated)
_ENCODER = msgspec.msgpack.Encoder()
_COMMAND: _Reader[Command] = _Reader(*get_args(Command))
_REPLY: _Reader[Reply] = _Reader(*get_args(Reply))
_SINGLE = (_Reader[Any](kind) for kind in (Setpoint, State, Event, Truth, Telemetry, Io, Info))
_READERS: tuple[_Reader[Any], ...] = (_COMMAND, _REPLY, *_SINGLE)
_READER_OF = {kind: reader for reader in _READERS for kind in reader.types.values()}


def encode(message: Message) -> bytes:
    """Return the bytes of a message, which is not validated.

    Raises:
        ProtocolError: A field has a value of a type that MessagePack does not have, such as a number of numpy.
    """
    try:
        return _ENCODER.encode(message)
    except FAULTS as error:
        raise explain_unencodable(message, error) from error


def check(message: _SomeMessage) -> _SomeMessage:
    """Validate a message constructed locally, as the server will; constructors validate nothing.

    Returns:
        The message as the server will decode it: integers in number fields become floats, lists become tuples.

    Raises:
        ProtocolError: A value is invalid for every robot.
    """
    reader = _READER_OF.get(type(message))
    if reader is None:
        raise ProtocolError("unknown_type", "type", f"{type(message).__name__} is not a message")
    checked: _SomeMessage = reader.read(encode(message))
    return checked


def refusal(error: ProtocolError) -> Refused:
    """Return the answer to a command that could not be decoded."""
    return Refused(code=error.code, where=error.where, why=error.why, limit=error.limit)


def decode_envelope(data: bytes) -> Envelope:
    """Return type and token of a message without checking other fields; ProtocolError if they are invalid."""
    return _decoded(_ENVELOPE, data, {})


def decode_command(data: bytes) -> Command:
    """Decode a command.

    Raises:
        ProtocolError: The bytes are not a valid command. `decode_reply` and `decode` raise this error, too.
    """
    if EXPLAINED_BYTES < len(data) <= MAX_BYTES and b"set_estimator" in data:
        decode_envelope(data)  # refuses bytes that are no MessagePack map
        # Validate a calibration in the bytes: first building a map of them may take a hundred times as long.
        _decoded(_CALIBRATED, data, {})
    return _COMMAND.read(data)


def decode_reply(data: bytes) -> Reply:
    """Decode the answer to a command."""
    return _REPLY.read(data)


def decode(kind: type[_SomeMessage], data: bytes) -> _SomeMessage:
    """Decode a message of a key on which all messages have the same type: `decode(State, data)`."""
    message: _SomeMessage = _READER_OF[kind].read(data)
    return message

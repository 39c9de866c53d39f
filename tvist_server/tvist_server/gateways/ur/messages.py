"""Robot messages: int32 length, uint8 20, uint64 time [µs], uint8 source, uint8 kind, body; big-endian."""

from enum import IntEnum
from struct import Struct
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot

ROBOT_MESSAGE: Final = 20
SOURCE: Final = 254  # source -2: neither a joint nor a board
LONGEST: Final = 1000
"""Longest text [bytes]: some clients reject packages of more than 2000 bytes."""

PROTECTIVE_STOP: Final = 209
READ_ONLY: Final = 210

_HEADER = Struct(">iBQBB")
_ERROR = Struct(">iiiII")
_SAFETY = Struct(">iiBII")
_PLACE = Struct(">ii")
_KEY = Struct(">iiB")
_POPUP = Struct(">IB???B")
_NUMBER = Struct(">i")
_VERSION = Struct(">BBii")


class MessageKind(IntEnum):
    """UR's numbers of the robot messages that are sent here."""

    TEXT = 0
    LABEL = 1
    POPUP = 2
    VERSION = 3
    SAFETY_MODE = 5
    ERROR_CODE = 6
    KEY = 7
    RUNTIME_EXCEPTION = 10


class ErrorLevel(IntEnum):
    """UR's levels of severity of an error code that are sent here."""

    WARNING = 2
    VIOLATION = 3


def stamp(snapshot: Snapshot | None) -> int:
    """Return the time of a tick for a package [µs]; 0 before the first tick."""
    return 0 if snapshot is None else round(1e6 * snapshot.timestamp)


def version(major: int, minor: int, bugfix: int, build: int, date: str) -> bytes:
    """Encode the software version, the first message that a client gets."""
    name = b"URControl"
    body = bytes([len(name)]) + name + _VERSION.pack(major, minor, bugfix, build) + _text(date)
    return _message(0, MessageKind.VERSION, body)


def text(time: int, what: str) -> bytes:
    """Encode a line for the log."""
    return _message(time, MessageKind.TEXT, _text(what))


def label(time: int, number: int, name: str) -> bytes:
    """Encode the line of the program tree, by number and name, that a program has reached."""
    return _message(time, MessageKind.LABEL, _NUMBER.pack(number) + _text(name))


def key(time: int, title: str, what: str) -> bytes:
    """Encode that a program has started or stopped: `PROGRAM_XXX_STARTED` or `PROGRAM_XXX_STOPPED`, and its name."""
    head = _text(title, 255)
    return _message(time, MessageKind.KEY, _KEY.pack(0, 0, len(head)) + head + _text(what))


def runtime_exception(time: int, line: int, column: int, what: str) -> bytes:
    """Encode why a program cannot continue or start; line and column count from 1."""
    return _message(time, MessageKind.RUNTIME_EXCEPTION, _PLACE.pack(line, column) + _text(what))


def error_code(time: int, code: int, argument: int, level: ErrorLevel, what: str) -> bytes:
    """Encode an error by its number, without data."""
    return _message(time, MessageKind.ERROR_CODE, _ERROR.pack(code, argument, level, 0, 0) + _text(what))


def safety_mode(time: int, mode: int) -> bytes:
    """Encode a change to a safety mode, given as RTDE's number."""
    return _message(time, MessageKind.SAFETY_MODE, _SAFETY.pack(0, 0, mode & 0xFF, 0, 0))


def popup(
    time: int, title: str, what: str, *, warning: bool = False, error: bool = False, blocking: bool = False
) -> bytes:
    """Encode a window for the operator; if it is `blocking`, the program waits until it is closed."""
    head = _text(title, 255)
    body = _POPUP.pack(0, 0, warning, error, blocking, len(head)) + head + _text(what)
    return _message(time, MessageKind.POPUP, body)


def _message(time: int, kind: MessageKind, body: bytes) -> bytes:
    return _HEADER.pack(_HEADER.size + len(body), ROBOT_MESSAGE, time, SOURCE, kind) + body


def _text(what: str, most: int = LONGEST) -> bytes:
    return what.encode(errors="replace")[:most].decode(errors="ignore").encode()

"""Robot messages: int32 length, uint8 20, uint64 time [µs], uint8 source, uint8 kind, body; big-endian.

Their time is that of the last tick, None before the first.
"""

from enum import IntEnum
from struct import Struct
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.version import DATE, VERSION

ROBOT_MESSAGE: Final = 20
SOURCE: Final = 254  # source -2: neither a joint nor a board
LONGEST: Final = 1000  # longest text [bytes]: some clients reject packages of more than 2000 bytes
WARNING, VIOLATION = 2, 3  # UR's levels of severity of an error code
PROTECTIVE_STOP, READ_ONLY = 209, 210  # UR's error codes

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


def stamp(tick: Snapshot | None) -> int:
    """Return the time of a tick for a package [µs]; 0 before the first tick."""
    return 0 if tick is None else round(1e6 * tick.timestamp)


def version() -> bytes:
    """Encode the software version, the first message that a client gets."""
    name = b"URControl"
    body = bytes([len(name)]) + name + _VERSION.pack(*VERSION) + _text(DATE)
    return _message(None, MessageKind.VERSION, body)


def text(tick: Snapshot | None, what: str) -> bytes:
    """Encode a line for the log."""
    return _message(tick, MessageKind.TEXT, _text(what))


def label(tick: Snapshot | None, number: int, name: str) -> bytes:
    """Encode the line of the program tree, by number and name, that a program has reached."""
    return _message(tick, MessageKind.LABEL, _NUMBER.pack(number) + _text(name))


def key(tick: Snapshot | None, title: str, what: str) -> bytes:
    """Encode that a program has started or stopped: `PROGRAM_XXX_STARTED` or `PROGRAM_XXX_STOPPED`, and its name."""
    head = _text(title, 255)
    return _message(tick, MessageKind.KEY, _KEY.pack(0, 0, len(head)) + head + _text(what))


def runtime_exception(tick: Snapshot | None, line: int, column: int, what: str) -> bytes:
    """Encode why a program cannot continue or start; line and column count from 1."""
    return _message(tick, MessageKind.RUNTIME_EXCEPTION, _PLACE.pack(line, column) + _text(what))


def error_code(tick: Snapshot | None, code: int, level: int, what: str) -> bytes:
    """Encode an error by its number, without an argument or data."""
    return _message(tick, MessageKind.ERROR_CODE, _ERROR.pack(code, 0, level, 0, 0) + _text(what))


def safety_mode(tick: Snapshot) -> bytes:
    """Encode a change to the safety mode of a tick."""
    return _message(tick, MessageKind.SAFETY_MODE, _SAFETY.pack(0, 0, tick.safety_mode & 0xFF, 0, 0))


def popup(
    tick: Snapshot | None, title: str, what: str, *, level: str | None = None, blocking: bool = False
) -> bytes:
    """Encode a window for the operator; if it is `blocking`, the program waits until it is closed."""
    head = _text(title, 255)
    flags = _POPUP.pack(0, 0, level == "warning", level == "error", blocking, len(head))
    return _message(tick, MessageKind.POPUP, flags + head + _text(what))


def _message(tick: Snapshot | None, kind: MessageKind, body: bytes) -> bytes:
    return _HEADER.pack(_HEADER.size + len(body), ROBOT_MESSAGE, stamp(tick), SOURCE, kind) + body


def _text(what: str, most: int = LONGEST) -> bytes:
    return what.encode(errors="replace")[:most].decode(errors="ignore").encode()

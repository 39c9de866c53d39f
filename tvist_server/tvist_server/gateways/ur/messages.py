"""Robot messages: int32 length, uint8 20, uint64 time [µs], uint8 source, uint8 kind, body; big-endian.

Every function takes the last tick (None before the first one), whose time goes into the message.
"""

from struct import Struct, pack
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.version import DATE, VERSION

LONGEST: Final = 1000  # longest text [bytes]: some clients reject packages of more than 2000 bytes
WARNING, VIOLATION = 2, 3  # UR's levels of severity of an error code
PROTECTIVE_STOP, READ_ONLY = 209, 210  # UR's error codes

_HEADER = Struct(">iBQBB")


def stamp(tick: Snapshot | None) -> int:
    """Return the time of a tick for a package [µs]; 0 before the first tick."""
    return 0 if tick is None else round(1e6 * tick.timestamp)


def version() -> bytes:
    """Encode the software version, the first message that a client gets."""
    name = b"URControl"
    return _message(None, 3, bytes([len(name)]) + name + pack(">BBii", *VERSION) + _text(DATE))


def text(tick: Snapshot | None, what: str) -> bytes:
    """Encode a line for the log."""
    return _message(tick, 0, _text(what))


def label(tick: Snapshot | None, number: int, name: str) -> bytes:
    """Encode the line of the program tree, by number and name, that a program has reached."""
    return _message(tick, 1, pack(">i", number) + _text(name))


def key(tick: Snapshot | None, title: str, what: str) -> bytes:
    """Encode that a program has started or stopped: `PROGRAM_XXX_STARTED` or `PROGRAM_XXX_STOPPED`, and its name."""
    head = _text(title, 255)
    return _message(tick, 7, pack(">iiB", 0, 0, len(head)) + head + _text(what))


def runtime_exception(tick: Snapshot | None, line: int, column: int, what: str) -> bytes:
    """Encode why a program cannot continue or start; line and column count from 1."""
    return _message(tick, 10, pack(">ii", line, column) + _text(what))


def error_code(tick: Snapshot | None, code: int, level: int, what: str) -> bytes:
    """Encode an error by its number, without an argument or data."""
    return _message(tick, 6, pack(">iiiII", code, 0, level, 0, 0) + _text(what))


def safety_mode(tick: Snapshot) -> bytes:
    """Encode a change to the safety mode of a tick."""
    return _message(tick, 5, pack(">iiBII", 0, 0, tick.safety_mode & 0xFF, 0, 0))


def popup(
    tick: Snapshot | None, title: str, what: str, *, level: str | None = None, blocking: bool = False
) -> bytes:
    """Encode a window for the operator; if it is `blocking`, the program waits until it is closed."""
    head = _text(title, 255)
    flags = pack(">IB???B", 0, 0, level == "warning", level == "error", blocking, len(head))
    return _message(tick, 2, flags + head + _text(what))


def _message(tick: Snapshot | None, kind: int, body: bytes) -> bytes:
    """Return a message; `kind` is UR's number of that message."""
    source = 254  # -2: neither a joint nor a board
    return _HEADER.pack(_HEADER.size + len(body), 20, stamp(tick), source, kind) + body


def _text(what: str, most: int = LONGEST) -> bytes:
    return what.encode(errors="replace")[:most].decode(errors="ignore").encode()

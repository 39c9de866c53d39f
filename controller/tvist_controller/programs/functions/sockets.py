"""Functions for sockets to other machines, and parsing of messages."""

import math
import re
from collections.abc import Callable, Generator
from struct import pack, unpack_from
from typing import Annotated, Any, TypeVar

from tvist_controller.programs.arguments import Flag, Number, Text, a_list, text, whole
from tvist_controller.programs.functions.group import FunctionGroup
from tvist_controller.programs.sockets import Take
from tvist_urscript import Value, costs, to_str
from tvist_urscript.texts import DECIMAL
from tvist_urscript.values import Array, to_bytes, to_text

MAX_VALUES = 30  # largest number of values per call
ANSWER = 2.0  # timeout for the value of a variable [s]
MORE = 25  # ticks of waiting for data after which moves that wait to be blended start
_ONE = "socket_0"  # default name of a socket
_VARIABLE = re.compile(r"\s*(\S+)\s+([+-]?\d+)\s*", re.ASCII)
LONGEST_NUMBER = 64  # longest number [bytes]
LONGEST_LINE = 1023  # longest line or string, the same as for texts in programs [bytes]
T = TypeVar("T")


def _named(name: str, value: object) -> str:
    """Return the name of a socket; numbers are accepted, as Robotiq's URCap uses them."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return to_str(value)
    return text(name, value)


Name = Annotated[str, _named]
Int32 = Annotated[int, whole(-(2**31), 2**31 - 1)]
Count = Annotated[int, whole(0, MAX_VALUES)]


class SocketFunctions(FunctionGroup):
    """Opens, closes, reads and writes sockets.

    Reading takes what has arrived and waits for the rest, without limit if the timeout is not above 0.
    Incomplete data stays for the next call after a timeout.
    """

    title = "Sockets"

    @costs(20)
    def socket_open(
        self, address: Text, port: Annotated[int, whole(1, 65535)], socket_name: Name = _ONE
    ) -> Generator[None, None, bool]:
        """Connect to a machine; return whether this has succeeded within 2 s.

        Programs may connect to the machine that sent them, to those that the server allows (`--ur-allow`),
        and to the gripper of a cell at `127.0.0.1` port 63352.
        """
        yield from self._arm.finish()
        return (yield from self._parts.sockets.connect(socket_name, address, port))

    @costs(5)
    def socket_close(self, socket_name: Name = _ONE) -> None:
        """Close a socket, if open."""
        self._arm.then(lambda: self._parts.sockets.disconnect(socket_name))

    @costs(10)
    def socket_read_binary_integer(
        self, number: Count, socket_name: Name = _ONE, timeout: Number = 2
    ) -> Generator[None, None, Array]:
        """Read up to 30 32-bit integers as `[n, v1, …, vn]`; `[0, -1, …, -1]` after the timeout."""
        return self._read_list(_integers, number, socket_name, timeout, -1)

    @costs(10)
    def socket_read_byte_list(
        self, number: Count, socket_name: Name = _ONE, timeout: Number = 2
    ) -> Generator[None, None, Array]:
        """Read up to 30 bytes as `[n, v1, …, vn]`; `[0, -1, …, -1]` after the timeout."""
        return self._read_list(_octets, number, socket_name, timeout, -1)

    @costs(20)
    def socket_read_ascii_float(
        self, number: Annotated[int, whole(1, MAX_VALUES)], socket_name: Name = _ONE, timeout: Number = 2
    ) -> Generator[None, None, Array]:
        """Read up to 30 numbers in brackets: `(1.5, 2)` is `[2, 1.5, 2]`; `[0, nan, …, nan]` on failure."""
        return self._read_list(_floats, number, socket_name, timeout, math.nan)

    @costs(10)
    def socket_read_line(self, socket_name: Name = _ONE, timeout: Number = 2) -> Generator[None, None, str]:
        """Read a line of at most 1023 bytes without its end; an empty text after the timeout."""
        return to_text((yield from self._read(socket_name, _line, timeout)) or b"")

    @costs(10)
    def socket_read_string(
        self,
        socket_name: Name = _ONE,
        prefix: Text = "",
        suffix: Text = "",
        interpret_escape: Flag = False,
        timeout: Number = 2,
    ) -> Generator[None, None, str]:
        r"""Read what has arrived, or the text between `prefix` and `suffix`; an empty text after the timeout.

        Leading spaces of both are ignored; with `interpret_escape` they may contain `\n`, `\r` and `\t`.
        """
        first, last = (
            to_bytes(_unescaped(one) if interpret_escape else one)
            for one in (prefix.lstrip(" "), suffix.lstrip(" "))
        )
        found = yield from self._read(socket_name, lambda got: _between(got, first, last), timeout)
        return to_text((found or b"")[:LONGEST_LINE])

    @costs(20)
    def socket_get_var(self, name: Text, socket_name: Name = _ONE) -> Generator[None, None, int]:
        r"""Send `GET name\n` and return the integer of the answer `name value\n`; 0 without one in 2 s."""
        yield from self._arm.finish()
        self._parts.sockets.send(socket_name, to_bytes(f"GET {name}\n"))
        return (yield from self._read(socket_name, lambda got: _variable(got, name), ANSWER)) or 0

    @costs(10)
    def socket_set_var(self, name: Text, value: Int32, socket_name: Name = _ONE) -> None:
        r"""Send `SET name value\n`."""
        self._send(socket_name, to_bytes(f"SET {name} {value}\n"))

    @costs(5)
    def socket_send_int(self, value: Int32, socket_name: Name = _ONE) -> bool:
        """Send a 32-bit integer in network byte order; return whether the socket is open."""
        return self._send(socket_name, pack(">i", value))

    @costs(5)
    def socket_send_byte(self, value: Annotated[int, whole(-128, 255)], socket_name: Name = _ONE) -> bool:
        """Send a byte, 0 to 255 or -128 to 127; return whether the socket is open."""
        return self._send(socket_name, bytes([value % 256]))

    @costs(10)
    def socket_send_line(self, str: Value, socket_name: Name = _ONE) -> bool:
        """Send a text and a line feed; return whether the socket is open."""
        return self._send(socket_name, to_bytes(to_str(str)) + b"\n")

    @costs(10)
    def socket_send_string(self, str: Value, socket_name: Name = _ONE) -> bool:
        """Send a text; return whether the socket is open."""
        return self._send(socket_name, to_bytes(to_str(str)))

    def _send(self, name: str, data: bytes) -> bool:
        self._arm.then(lambda: self._parts.sockets.send(name, data))
        return self._parts.sockets.is_open(name)

    def _read_list(
        self,
        take: Callable[[bytes, int], tuple[tuple[Any, ...] | None, int] | None],
        count: int,
        name: str,
        timeout: float,
        missing: float,
    ) -> Generator[None, None, Array]:
        """Read `count` values; return a list of their number and the values. If missing, the number is 0."""
        found = yield from self._read(name, lambda got: take(got, count), timeout)
        return a_list((0,) + (missing,) * count if found is None else (count, *found))

    def _read(self, name: str, take: Take[T], timeout: float) -> Generator[None, None, T | None]:
        return self._parts.sockets.read(name, take, timeout, self._go_on)

    def _go_on(self, waited: int) -> None:
        """If no data came, start moves that wait for a further move; that may still be blended in motion."""
        if waited >= MORE:
            self._arm.begin()


# ---------------------------------------------------------------------- messages
#
# Each function gets the received bytes and returns a message with its length in bytes, or None while it is
# incomplete. An invalid message is None with the number of bytes to discard.


def _integers(received: bytes, number: int) -> tuple[tuple[int, ...], int] | None:
    if len(received) < 4 * number:
        return None
    return unpack_from(f">{number}i", received), 4 * number


def _octets(received: bytes, number: int) -> tuple[tuple[int, ...], int] | None:
    return None if len(received) < number else (tuple(received[:number]), number)


def _line(received: bytes) -> tuple[bytes, int] | None:
    """Parse a line ended by LF or CR LF; cut longer ones at `LONGEST_LINE`."""
    end = received.find(b"\n", 0, LONGEST_LINE + 1)
    if end >= 0:
        return received[:end].removesuffix(b"\r"), end + 1
    return (received[:LONGEST_LINE], LONGEST_LINE) if len(received) > LONGEST_LINE else None


def _between(received: bytes, prefix: bytes, suffix: bytes) -> tuple[bytes, int] | None:
    """Parse the text between a prefix and a suffix (without suffix, all text); drop the text before it."""
    start = received.find(prefix)
    if start < 0:
        return None
    start += len(prefix)
    end = received.find(suffix, start) if suffix else min(len(received), start + LONGEST_LINE)
    if end < 0 or (not suffix and end == start):
        return None
    return received[start:end], end + len(suffix)


def _floats(received: bytes, number: int) -> tuple[tuple[float, ...] | None, int] | None:
    """Parse comma-separated numbers in brackets with optional line end: `( 1.414 , 3.14159, 1.616, 0.0 )`."""
    end = received.find(b")")
    if end < 0:
        return None
    rest = next((len(mark) for mark in (b"\n", b"\r\n") if received.startswith(mark, end + 1)), 0)
    start = received.rfind(b"(", 0, end)
    parts = received[start + 1 : end].decode("ascii", "replace").split(",")
    short = all(len(part) <= LONGEST_NUMBER for part in parts)  # the pattern is slow for long ones
    valid = start >= 0 and len(parts) == number and short and all(map(DECIMAL.fullmatch, parts))
    return tuple(map(float, parts)) if valid else None, end + 1 + rest


def _variable(received: bytes, name: str) -> tuple[int | None, int] | None:
    """Parse the answer to a variable request, skipping blank lines whose line feed came late."""
    begin = len(received) - len(received.lstrip(b"\r\n"))
    if (found := _line(received[begin:])) is None:
        return None
    answer = _VARIABLE.fullmatch(found[0].decode("ascii", "replace"))
    if answer is None or answer[1] != name or len(answer[2]) > LONGEST_NUMBER:
        return None, begin + found[1]
    value = int(answer[2])
    return value if -(2**31) <= value < 2**31 else None, begin + found[1]


def _unescaped(text: str) -> str:
    r"""Replace `\n`, `\r`, `\t`, `\\` and `\"` by the characters they represent."""
    known = {"n": "\n", "r": "\r", "t": "\t", "\\": "\\", '"': '"'}
    return re.sub(r"\\(.)", lambda match: known.get(match[1], match[0]), text)

"""Functions for sockets, over which programs talk to other machines."""

import math
from collections.abc import Callable, Generator
from struct import pack
from typing import Any, TypeVar

from tvist_controller.programs import socket_messages as cut
from tvist_controller.programs.arguments import a_list, flag, integer, number, text
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.sockets import Sockets, Take
from tvist_urscript import Value, costs, to_str
from tvist_urscript.values import Array, to_bytes, to_text

MOST = 30
"""Most values that one call reads."""
ANSWER = 2.0
"""Time to wait for the value of a variable [s]."""
MORE = 25
"""Ticks for which a program waits for more data before the moves start that wait to be blended into a next one."""
_ONE = "socket_0"
"""Name of a socket that a call does not name."""
T = TypeVar("T")


class SocketFunctions:
    """Opens and closes sockets, and reads and writes them.

    Reading takes what has arrived, and waits for the rest. It waits for ever if the time-out is not above 0. What has
    arrived incompletely when the time is over stays for the next call.

    Args:
        sockets: The sockets of the robot's programs.
        arm: Its arm: what is sent after a move that is blended is sent where the blend begins.
    """

    def __init__(self, sockets: Sockets, arm: ProgramArm) -> None:
        self._sockets, self._arm = sockets, arm

    @costs(20)
    def socket_open(
        self, address: object, port: object, socket_name: object = _ONE
    ) -> Generator[None, None, bool]:
        """Connect to a machine; return whether this has succeeded within 2 s.

        Programs may connect to the machine that sent them, to those that the server allows (`--ur-allow`), and to the
        gripper of a cell at `127.0.0.1` port 63352.
        """
        machine, at = text("address", address), integer("port", port, 1, 65535)
        name = _named(socket_name)
        yield from self._arm.finish()
        return (yield from self._sockets.connect(name, machine, at))

    @costs(5)
    def socket_close(self, socket_name: object = _ONE) -> None:
        """Close a socket. Nothing happens if it is not open."""
        name = _named(socket_name)
        self._arm.then(lambda: self._sockets.disconnect(name))

    @costs(10)
    def socket_read_binary_integer(
        self, number: object, socket_name: object = _ONE, timeout: object = 2
    ) -> Generator[None, None, Array]:
        """Read integers of 32 bits, at most 30, as `[n, v1, …, vn]`; `[0, -1, …, -1]` when the time is over."""
        return self._read_list(cut.integers, integer("number", number, 0, MOST), socket_name, timeout, -1)

    @costs(10)
    def socket_read_byte_list(
        self, number: object, socket_name: object = _ONE, timeout: object = 2
    ) -> Generator[None, None, Array]:
        """Read bytes, at most 30, as `[n, v1, …, vn]`; `[0, -1, …, -1]` when the time is over."""
        return self._read_list(cut.octets, integer("number", number, 0, MOST), socket_name, timeout, -1)

    @costs(20)
    def socket_read_ascii_float(
        self, number: object, socket_name: object = _ONE, timeout: object = 2
    ) -> Generator[None, None, Array]:
        """Read numbers in brackets, at most 30: `(1.5, 2)` is `[2, 1.5, 2]`; `[0, nan, …, nan]` if that fails."""
        return self._read_list(cut.floats, integer("number", number, 1, MOST), socket_name, timeout, math.nan)

    @costs(10)
    def socket_read_line(self, socket_name: object = _ONE, timeout: object = 2) -> Generator[None, None, str]:
        """Read a line of at most 1023 bytes, without its end; an empty text when the time is over."""
        found = yield from self._read(socket_name, cut.line, timeout)
        return to_text(found or b"")

    @costs(10)
    def socket_read_string(
        self,
        socket_name: object = _ONE,
        prefix: object = "",
        suffix: object = "",
        interpret_escape: object = False,
        timeout: object = 2,
    ) -> Generator[None, None, str]:
        r"""Read what has arrived, or what stands between `prefix` and `suffix`; an empty text when the time is over.

        Leading spaces of both do not count; with `interpret_escape` they may contain `\n`, `\r` and `\t`.
        """
        escaped = flag("interpret_escape", interpret_escape)
        first, last = (
            to_bytes(cut.unescaped(one) if escaped else one)
            for one in (text("prefix", prefix).lstrip(" "), text("suffix", suffix).lstrip(" "))
        )
        found = yield from self._read(socket_name, lambda got: cut.between(got, first, last), timeout)
        return to_text((found or b"")[: cut.LONGEST_LINE])

    @costs(20)
    def socket_get_var(self, name: object, socket_name: object = _ONE) -> Generator[None, None, int]:
        r"""Send `GET name\n` and return the integer of the answer `name value\n`; 0 if none comes within 2 s."""
        wanted, socket = text("name", name), _named(socket_name)
        yield from self._arm.finish()
        self._sockets.send(socket, to_bytes(f"GET {wanted}\n"))
        found = yield from self._sockets.read(socket, lambda got: cut.variable(got, wanted), ANSWER, _idle)
        return found or 0

    @costs(10)
    def socket_set_var(self, name: object, value: object, socket_name: object = _ONE) -> None:
        r"""Send `SET name value\n`."""
        wanted, given = text("name", name), integer("value", value, -(2**31), 2**31 - 1)
        self._send(socket_name, to_bytes(f"SET {wanted} {given}\n"))

    @costs(5)
    def socket_send_int(self, value: object, socket_name: object = _ONE) -> bool:
        """Send an integer of 32 bits in network byte order; return whether the socket is open."""
        return self._send(socket_name, pack(">i", integer("value", value, -(2**31), 2**31 - 1)))

    @costs(5)
    def socket_send_byte(self, value: object, socket_name: object = _ONE) -> bool:
        """Send a byte, 0 to 255 or -128 to 127; return whether the socket is open."""
        return self._send(socket_name, bytes([integer("value", value, -128, 255) % 256]))

    @costs(10)
    def socket_send_line(self, str: Value, socket_name: object = _ONE) -> bool:
        """Send a text and a line feed; return whether the socket is open."""
        return self._send(socket_name, to_bytes(to_str(str)) + b"\n")

    @costs(10)
    def socket_send_string(self, str: Value, socket_name: object = _ONE) -> bool:
        """Send a text; return whether the socket is open."""
        return self._send(socket_name, to_bytes(to_str(str)))

    def _send(self, socket_name: object, data: bytes) -> bool:
        name = _named(socket_name)

        def send() -> None:
            self._sockets.send(name, data)

        self._arm.then(send)
        return self._sockets.is_open(name)

    def _read_list(
        self,
        take: Callable[[bytes, int], tuple[tuple[Any, ...] | None, int] | None],
        count: int,
        socket_name: object,
        timeout: object,
        missing: float,
    ) -> Generator[None, None, Array]:
        """Read so many values; they follow their number, which is 0 if they are missing."""
        found = yield from self._read(socket_name, lambda got: take(got, count), timeout)
        return a_list((0,) + (missing,) * count if found is None else (count, *found))

    def _read(self, socket_name: object, take: Take[T], timeout: object) -> Generator[None, None, T | None]:
        name, longest = _named(socket_name), number("timeout", timeout)
        return self._sockets.read(name, take, longest, self._go_on)

    def _go_on(self, waited: int) -> Generator[None, None, None]:
        """Begin the moves that wait for a further one, if its data have not come by now; it may come under way."""
        if waited >= MORE:
            self._arm.begin()
        yield from ()


def _named(socket_name: object) -> str:
    """Return the name of a socket; a number is one, as in the functions that Robotiq's URCap brings along."""
    if isinstance(socket_name, int | float) and not isinstance(socket_name, bool):
        return to_str(socket_name)
    return text("socket_name", socket_name)


def _idle(_: int) -> Generator[None, None, None]:
    yield from ()

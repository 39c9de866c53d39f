"""A connection to a robot's RTDE interface, which never blocks longer than the given timeout."""

import contextlib
import os
import selectors
import socket
import time
from collections.abc import Sequence
from typing import Any

from tvist_plant.plant import PERIOD
from tvist_server.rtde.client import Row, RtdeClient, RtdeError
from tvist_server.watching.address import PORT, RobotAddress

ANSWERS = 3.0  # longest time for a robot to accept a connection and start sending [s]
SILENT = 1.0  # time without a new row after which a connection is lost [s], as in UR's own clients
Address = tuple[socket.AddressFamily, tuple[Any, ...]]
"""Family of an address, and the address as `socket` has it."""
AT_ONCE = 1 << 16  # largest number of bytes per read: two seconds of rows


class LostError(Exception):
    """There is no connection, or it is lost; the message gives the reason."""


class UnreachableError(LostError):
    """Nothing answers at the address."""


class RtdeConnection:
    """A connection to the robot at `place`. `address` is `resolve`'s result; `client` encodes and decodes."""

    def __init__(self, place: RobotAddress, address: Address, client: RtdeClient) -> None:
        self._place, self.client = place, client
        self.texts: list[str] = []  # messages of the controller, until the caller clears the list
        self._begun = self._heard = time.monotonic()
        self._connected, self._newest, self._rest = False, -1, b""
        self._socket = socket.socket(address[0], socket.SOCK_STREAM)
        self._selector = selectors.DefaultSelector()
        self._socket.setblocking(False)
        with contextlib.suppress(BlockingIOError, OSError):  # `rows` reports the error
            self._socket.connect(address[1])
        self._selector.register(self._socket, selectors.EVENT_WRITE)

    def rows(self, timeout: float) -> Sequence[Row]:
        """Wait at most `timeout` [s] for rows and return them; LostError if the connection is lost."""
        try:
            ready = self._selector.select(max(0.0, timeout)) or self._selector.select(0.0)
            if ready and not self._connected:
                self._begin()
                return ()
            rows = self._read() if ready else ()
        except RtdeError as error:
            raise LostError(f"{self._place}: {error}") from error
        except OSError as error:
            why = error.strerror or str(error)
            raise UnreachableError(f"no robot answers at {self._place}: {why}") from error
        self._check_silence()
        return rows

    def write(self, numbers: Sequence[float]) -> None:
        """Write all inputs without blocking; if the link does not take the package at once, drop it."""
        if not self.client.started:
            return
        self._rest = self._rest[self._give(self._rest) :]
        if not self._rest:
            data = self.client.write(numbers)
            self._rest = data[self._give(data) :]

    def _give(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except OSError:  # reading reports a lost connection
            return 0

    def close(self) -> None:
        """Close the connection."""
        self._selector.close()
        self._socket.close()

    def _begin(self) -> None:
        error = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if error:
            raise OSError(error, os.strerror(error))
        self._connected = True
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._selector.modify(self._socket, selectors.EVENT_READ)
        self._socket.sendall(self.client.begin())

    def _read(self) -> Sequence[Row]:
        data = self._socket.recv(AT_ONCE)
        if not data:
            raise LostError(f"the robot at {self._place} has closed the connection")
        news = not self.client.started
        received = self.client.receive(data)
        self.texts += received.texts
        for row in received.rows:
            before, self._newest = self._newest, round(row["timestamp"][0] / PERIOD)
            news |= self._newest != before
        if news:
            self._heard = time.monotonic()
        if received.send:
            self._socket.sendall(received.send)
        return received.rows

    def _check_silence(self) -> None:
        now = time.monotonic()
        if self.client.started and now - self._heard > SILENT:
            raise LostError(f"the robot at {self._place} has sent no new row for {SILENT:g} s")
        if not self.client.started and now - self._begun > ANSWERS:
            if self._connected:
                hint = "" if self._place.port == PORT else f", whose port is {PORT} on a robot of UR's"
                raise LostError(f"{self._place} does not answer as RTDE does within {ANSWERS:g} s{hint}")
            raise UnreachableError(f"no robot answers at {self._place} within {ANSWERS:g} s")


def resolve(place: RobotAddress) -> Address:
    """Resolve an address, which may take seconds; raise LostError if it has none."""
    try:
        found = socket.getaddrinfo(place.host, place.port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise LostError(f"{place} has no address: {error.strerror or error}") from error
    return found[0], found[4]

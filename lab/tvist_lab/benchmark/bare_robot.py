"""A process that does over one TCP connection what a robot with a driver's program does, without a robot.

    python -m tvist_lab.benchmark.bare_robot PORT

It sends a sample every 2 ms, reads the messages that answer them, and counts a time-out whenever none has come for the
time that the last one gave. It ends with the connection.
"""

import socket
import struct
import sys
import time
from select import select

from tvist_lab.benchmark.reverse_client import HOST, MESSAGE, SAMPLE
from tvist_lab.benchmark.rtde_clients import PERIOD


class BareRobot:
    """Counts messages and time-outs."""

    def __init__(self) -> None:
        self.timeouts = 0
        self._q = (0,) * 6
        self._last = 0
        self._data = b""
        self._latest = float("inf")
        """When the present wait for a message times out [s]."""
        self._timeout = float("inf")

    def take(self, now: float, data: bytes) -> None:
        """Take received bytes."""
        self.look(now)
        self._data += data
        while len(self._data) >= MESSAGE.size:
            timeout, *q, self._last = MESSAGE.unpack_from(self._data)
            self._data = self._data[MESSAGE.size :]
            self._q, self._timeout = tuple(q), timeout / 1000
            self._latest = now + self._timeout

    def look(self, now: float) -> None:
        """Count the waits that are over."""
        while now > self._latest:
            self.timeouts += 1
            self._latest += self._timeout

    def sample(self, now: float) -> bytes:
        """Return a sample."""
        return SAMPLE.pack(now, *self._q, self.timeouts, self._last)


def main(port: int) -> None:
    """Send and read until the connection ends."""
    robot = BareRobot()
    with socket.create_connection((HOST, port)) as stream:
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        tick = time.monotonic()
        while True:
            now = time.monotonic()
            readable, _, _ = select([stream], [], [], max(0.0, tick - now))
            now = time.monotonic()
            if readable:
                data = stream.recv(65536)
                if not data:
                    return
                robot.take(now, data)
            if now >= tick:
                robot.look(now)
                stream.sendall(robot.sample(now))
                tick = max(tick + PERIOD, now)


if __name__ == "__main__":
    try:
        main(int(sys.argv[1]))
    except (ConnectionError, struct.error):
        sys.exit(0)

"""A client like a driver: it answers each sample of a robot with a message on the socket that the program opened.

    python -m tvist_lab.benchmark.reverse_client ADDRESS RTDE_PORT PRIMARY_PORT
    python -m tvist_lab.benchmark.reverse_client echo

The second form has a bare process instead of the robot, see `bare_robot`. A line on stdout says that messages go to and
fro. A byte on stdin begins the counting; when stdin ends, another line gives the counts, see `Exchange`.
"""

import json
import math
import os
import selectors
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from tvist_lab.benchmark.rtde_clients import PERIOD, Client

HOST = "127.0.0.1"
TIMEOUT = 20
"""Time-out of the robot's program that each message gives [ms]."""
MESSAGE = struct.Struct(">8i")
"""A message: time-out [ms], joint positions [µrad], number of the message."""
SAMPLE = struct.Struct(">d8i")
"""A sample of the bare process: time [s], joint positions [µrad], time-outs, number of the last message read."""
WARM = 500
"""Samples before it says that messages go to and fro; by then all of the server's code has been compiled and loaded."""
SWING = 0.05
"""Amplitude of the motion of the last joint [rad]."""
CYCLE = 4.0
"""Period of the motion [s]."""
PATIENCE = 60.0
"""Longest wait for the robot's program [s]."""

PROGRAM = """def driver():
  target = get_target_joint_positions()
  thread follow():
    while True:
      enter_critical
      q = target
      exit_critical
      servoj(q, t=0.002, lookahead_time=0.03, gain=2000)
    end
  end
  connected = socket_open("{address}", {port}, "client")
  if not connected:
    popup("The client does not listen.", blocking=True)
  end
  follower = run follow()
  timeouts = 0
  timeout = 0
  while connected:
    message = socket_read_binary_integer(8, "client", timeout)
    if message[0] == 8:
      timeout = message[1] / 1000
      enter_critical
      i = 0
      while i < 6:
        target[i] = message[i + 2] / 1000000
        i = i + 1
      end
      exit_critical
      write_output_integer_register(1, message[8])
    else:
      timeouts = timeouts + 1
      write_output_integer_register(0, timeouts)
    end
  end
end
"""
"""The robot's program: one thread moves the arm, and the other reads where to. It counts time-outs and goes on."""


@dataclass
class Exchange:
    """What the samples tell about the messages, since the counting began."""

    messages: int = 0
    """Messages that were read."""
    timeouts: list[float] = field(default_factory=list)
    """When each time-out was told [s]."""
    longest_gap: float = 0.0
    """Longest time between two samples that told of a new message [s]."""
    samples: int = 0
    """Samples since the first message was read, counted or not."""
    _counting: bool = False
    _before: tuple[int, int] = (0, 0)
    """Time-outs and number of the last message in the sample before."""
    _new: float = 0.0
    """When the last sample that told of a new message came."""

    def begin(self) -> None:
        """Begin to count."""
        self._counting = True

    def take(self, now: float, timeouts: int, last: int) -> None:
        """Take a sample.

        Args:
            now: When it came [s].
            timeouts: Time-outs since the start.
            last: Number of the last message that was read; they are numbered 1, 2, 3 …
        """
        if last == 0:
            return
        before, self._before = self._before, (timeouts, last)
        self.samples += 1
        if self._counting:
            self.timeouts += [now] * (timeouts - before[0])
            self.messages += last - before[1]
            if last != before[1]:
                self.longest_gap = max(self.longest_gap, now - self._new)
        if last != before[1]:
            self._new = now

    def said(self) -> dict[str, Any]:
        """Return the counts as one JSON object."""
        return {"messages": self.messages, "timeouts": self.timeouts, "longest_gap_s": self.longest_gap}


class Sender:
    """Sends messages that let the last joint swing.

    Args:
        stream: The socket.
    """

    def __init__(self, stream: socket.socket) -> None:
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._stream = stream
        self._sent = 0
        self._middle: tuple[int, ...] | None = None

    def send(self, q: tuple[int, ...]) -> None:
        """Send the next message; `q` are the joint positions of the sample that it answers [µrad]."""
        self._middle = self._middle or q
        # The square of the sine starts with zero velocity.
        swing = SWING * math.sin(math.pi * self._sent * PERIOD / CYCLE) ** 2
        self._sent += 1
        last = self._middle[5] + round(1e6 * swing)
        self._stream.sendall(MESSAGE.pack(TIMEOUT, *self._middle[:5], last, self._sent))


class Driver(Client):
    """Client of a robot.

    Args:
        address: IP address of the robot.
        rtde: Port of its RTDE interface.
        primary: Port of its primary interface.
        exchange: Takes its samples.
    """

    def __init__(self, address: str, rtde: int, primary: int, exchange: Exchange) -> None:
        self._exchange = exchange
        with socket.create_server((HOST, 0)) as server:
            server.settimeout(PATIENCE)
            port = server.getsockname()[1]
            _send_program(address, primary, PROGRAM.format(address=HOST, port=port))
            stream, _ = server.accept()
        self._sender = Sender(stream)
        super().__init__(
            address, rtde, ["timestamp", "target_q", "output_int_register_0", "output_int_register_1"]
        )

    def sample(self, values: bytes) -> None:
        """Answer a sample."""
        super().sample(values)
        now = time.monotonic()
        _, *q, timeouts, last = struct.unpack(">d6d2i", values)
        self._sender.send(tuple(round(1e6 * angle) for angle in q))
        self._exchange.take(now, timeouts, last)


class Echo:
    """Client of a bare process.

    Args:
        exchange: Takes its samples.
    """

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        with socket.create_server((HOST, 0)) as server:
            port = str(server.getsockname()[1])
            self._process = subprocess.Popen([sys.executable, "-m", "tvist_lab.benchmark.bare_robot", port])  # noqa: S603
            server.settimeout(PATIENCE)
            self.socket, _ = server.accept()
        self._sender = Sender(self.socket)
        self._data = b""

    def read(self) -> bool:
        """Answer the samples that have come; return whether the connection is still open."""
        data = self.socket.recv(65536)
        self._data += data
        while len(self._data) >= SAMPLE.size:
            now = time.monotonic()
            _, *q, timeouts, last = SAMPLE.unpack_from(self._data)
            self._data = self._data[SAMPLE.size :]
            self._sender.send(tuple(q))
            self._exchange.take(now, timeouts, last)
        return bool(data)


def _send_program(address: str, port: int, text: str) -> None:
    """Send a program, and leave when it has arrived: who leaves with states unread may take it back."""
    with socket.create_connection((address, port), PATIENCE) as stream:
        stream.sendall(text.encode())
        stream.shutdown(socket.SHUT_WR)
        while stream.recv(65536):
            pass


def _run(connect: Callable[[Exchange], Client | Echo]) -> None:
    """Answer samples until stdin ends."""
    exchange = Exchange()
    client, told = connect(exchange), False
    selector = selectors.DefaultSelector()
    selector.register(client.socket, selectors.EVENT_READ, client)
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    while True:
        for key, _ in selector.select():
            if key.data is not None:
                if not client.read():
                    raise SystemExit("the robot closed the connection")
            elif os.read(sys.stdin.fileno(), 1):
                exchange.begin()
            else:
                sys.stdout.write(json.dumps(exchange.said()) + "\n")
                return
        if exchange.samples > WARM and not told:
            told = True
            sys.stdout.write("ready\n")
            sys.stdout.flush()


if __name__ == "__main__":
    if sys.argv[1] == "echo":
        _run(Echo)
    else:
        _run(lambda exchange: Driver(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), exchange))

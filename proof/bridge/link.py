"""A link between two addresses, in a process of its own: each way takes 1 ms ± 0.5 ms, and it fails on demand.

`python -m proof.bridge.link ROBOT NEAR` passes bytes on between the ports of the robot's interfaces at two addresses of
this machine. It does what the lines on its standard input say, and answers each with `done`.
"""

import contextlib
import random
import socket
import subprocess
import sys
import threading
import time
from queue import SimpleQueue
from typing import Self

PORTS = (29999, 30001, 30002, 30004)
"""Dashboard, primary and secondary interface, RTDE."""
DELAY = (0.5e-3, 1.5e-3)
"""Range of the time that bytes take, which keep their order [s]."""
CHUNK, ROOM = 4096, 1 << 14
"""Bytes that are passed on at once, and that each side of a connection holds."""


class Link:
    """Listens at an address, and connects to the robot.

    Args:
        robot: Its IP address.
        near: IP address that stands for it.
        seed: Seed of the delays.
        slower: Factor of the delays, beside a robot whose time passes more slowly.
    """

    def __init__(self, robot: str, near: str, seed: int = 0, slower: float = 1.0) -> None:
        self._robot, self._near, self._random = robot, near, random.Random(seed)  # noqa: S311  nothing secret
        self._delay = DELAY[0] * slower, DELAY[1] * slower
        self._flows, self._lock = threading.Event(), threading.Lock()
        self._rate: float | None = None
        self._open: set[socket.socket] = set()
        self._listening: list[socket.socket] = []
        self.restore()

    def freeze(self) -> None:
        """Let nothing pass, as with a cable that is pulled: connections stay, and what comes waits."""
        self._flows.clear()

    def flow(self) -> None:
        """Let pass what has waited and what comes."""
        self._flows.set()

    def throttle(self, rate: str) -> None:
        """Let pass so many bytes a second each way; 0: as many as come."""
        self._rate = float(rate) or None

    def cut(self) -> None:
        """Break all connections, and refuse new ones."""
        with self._lock:
            ended = (*self._listening, *self._open)
            self._listening, self._open = [], set()
        for one in ended:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        self.flow()

    def restore(self) -> None:
        """Take connections again."""
        self.flow()
        for port in PORTS:
            listening = socket.create_server((self._near, port))
            self._listening.append(listening)
            threading.Thread(target=self._accept, args=(listening, port), daemon=True).start()

    def _accept(self, listening: socket.socket, port: int) -> None:
        while True:
            try:
                near, _ = listening.accept()
            except OSError:
                return
            try:
                far = socket.create_connection((self._robot, port))
            except OSError:
                near.close()
                continue
            for one in (near, far):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                for room in (socket.SO_SNDBUF, socket.SO_RCVBUF):
                    one.setsockopt(socket.SOL_SOCKET, room, ROOM)
            with self._lock:
                self._open |= {near, far}
            for source, sink in ((near, far), (far, near)):
                under_way = SimpleQueue[tuple[float, bytes]]()
                threading.Thread(target=self._take, args=(source, under_way), daemon=True).start()
                threading.Thread(target=self._give, args=(sink, under_way), daemon=True).start()

    def _take(self, source: socket.socket, under_way: "SimpleQueue[tuple[float, bytes]]") -> None:
        data = b"x"
        while data:
            self._flows.wait()
            try:
                data = source.recv(CHUNK)
            except OSError:
                data = b""
            if self._rate is not None:
                time.sleep(len(data) / self._rate)
            under_way.put((time.monotonic() + self._random.uniform(*self._delay), data))

    def _give(self, sink: socket.socket, under_way: "SimpleQueue[tuple[float, bytes]]") -> None:
        while True:
            due, data = under_way.get()
            time.sleep(max(0.0, due - time.monotonic()))
            self._flows.wait()
            try:
                if not data:
                    sink.shutdown(socket.SHUT_WR)
                    return
                sink.sendall(data)
            except OSError:
                return


class LinkProcess:
    """A link in another process, which ends with this object's use as a context.

    Args:
        robot: See `Link`, as for the other address.
        near: Where it listens.
        seed: Seed of the delays.
        slower: See `Link`.
    """

    def __init__(self, robot: str, near: str, seed: int = 0, slower: float = 1.0) -> None:
        command = [sys.executable, "-m", "proof.bridge.link", robot, near, str(seed), str(slower)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self) -> Self:
        self.do("flow")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()

    def do(self, what: str) -> None:
        """Let it `freeze`, `flow`, `throttle RATE`, be `cut` or `restore`, and wait until it has."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(what, file=self._process.stdin, flush=True)
        if self._process.stdout.readline() != "done\n":
            raise RuntimeError(f"the link has ended instead of doing {what}")


if __name__ == "__main__":
    link = Link(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    for line in sys.stdin:
        name, *arguments = line.split()
        getattr(link, name)(*arguments)
        print("done", flush=True)

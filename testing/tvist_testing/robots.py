"""The test's side of the process that makes robots."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import msgspec

from tvist_testing.markers import WantedRobot

PATIENCE = 300.0
"""Longest wait for an answer of the process [s]; the first start compiles, for minutes on a slow machine."""
ENDING = 30.0  # longest wait for a robot to end in order [s]
NEEDED = (
    "tvist_server", "tvist_shaping", "tvist_urscript",
    "numpy", "numba", "pinocchio", "ruckig", "mcap", "zstandard", "cryptography",
)  # fmt: skip
"""Packages that a robot needs, most of them from the extra `server`."""


class CannotServeError(RuntimeError):
    """No robot can be served; the message says why and what to do."""


class RobotProcess:
    """A robot in its own process.

    Attributes:
        endpoint: Zenoh endpoint on which it listens.
        host: IP address of UR's interfaces; empty if they are closed.
        ports: Port of each of UR's interfaces.
        pid: Number of its process.
        closed: Whether it has ended, or will end when its last client is gone.
    """

    def __init__(self, connection: socket.socket, told: dict[str, Any]) -> None:
        self.endpoint = str(told["endpoint"])
        self.host = str(told.get("host", ""))
        self.ports: dict[str, int] = told.get("ports", {})
        self.pid = int(told["pid"])
        self.closed = False
        self._connection = connection

    def publish_state(self) -> None:
        """Let the robot publish its present state again."""
        self._connection.sendall(b"state\n")

    def close(self) -> None:
        """End the robot in order, so that its recording is complete; kill it if it does not answer."""
        self._leave(b"close\n")

    def discard(self) -> None:
        """End the robot without completing its recording."""
        if self.host:
            self._leave(b"leave\n")
        else:
            self.kill()

    def _leave(self, order: bytes) -> None:
        """Tell the robot to end; it continues while clients of UR's interfaces are connected."""
        if self.closed:
            return
        with contextlib.suppress(OSError):
            os.kill(self.pid, signal.SIGCONT)  # a test may have stopped it
            self._connection.settimeout(ENDING)
            self._connection.sendall(order)
            if _line(self._connection).get("clients"):
                self.closed = True
                return
            self._wait()
        self.kill()

    def forget(self) -> None:
        """Let a robot that has clients continue; it ends when this process ends, and the clients with it."""
        self._connection.detach()

    def kill(self) -> None:
        """Kill the robot's process, even if a test has stopped it; its recording stays incomplete."""
        if self.closed:
            return
        with contextlib.suppress(OSError):
            self._connection.settimeout(ENDING)
            os.kill(self.pid, signal.SIGKILL)
            self._wait()
        self._connection.close()
        self.closed = True

    def _wait(self) -> None:
        """Wait until the robot's process has ended: that closes the socket."""
        while self._connection.recv(4096):
            pass


class Robots:
    """The process that makes robots, started with the first one; there is one for each process of tests."""

    def __init__(self) -> None:
        self._running: tuple[subprocess.Popen[bytes], socket.socket] | None = None
        self._served: list[RobotProcess] = []

    def serve(self, wanted: WantedRobot) -> RobotProcess:
        """Serve a robot; return it when it answers. Raise CannotServeError if it cannot start."""
        if self._running is None or self._running[0].poll() is not None:
            self.close()
            self._running = _started()
        _, requests = self._running
        ours, theirs = socket.socketpair()
        ours.settimeout(PATIENCE)
        with theirs:
            line = msgspec.json.encode(wanted) + b"\n"
            sent = socket.send_fds(requests, [line], [theirs.fileno()])
            requests.sendall(line[sent:])
        told = _line(ours)
        if "endpoint" not in told:
            ours.close()
            raise CannotServeError(str(told.get("error", f"the robot ended at its start: see {wanted.log}")))
        served = RobotProcess(ours, told)
        self._served.append(served)
        return served

    def close(self) -> None:
        """End the process and robots that still run."""
        for served in self._served:
            if served.closed:
                served.forget()
            else:
                served.kill()
        self._served.clear()
        if self._running is not None:
            process, requests = self._running
            requests.close()
            process.wait(PATIENCE)
        self._running = None


def _started() -> tuple[subprocess.Popen[bytes], socket.socket]:
    """Start the process; return it and the socket for requests."""
    ours, theirs = socket.socketpair()
    ours.settimeout(PATIENCE)
    # Small matrices need no threads, and a process with threads cannot fork safely.
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with theirs:
        process = subprocess.Popen(  # noqa: S603  this interpreter and a module of this package
            [sys.executable, "-m", "tvist_testing.nursery", str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            env={**os.environ, "PYTHONUNBUFFERED": "1", **single},
        )
    if not ours.recv(64):
        ours.close()
        process.wait(PATIENCE)
        raise CannotServeError(
            "the process that makes robots ended at its start: see what it wrote to stderr"
        )
    return process, ours


def unavailable() -> str | None:
    """Return why no robot can be served here; None if one can."""
    if not hasattr(os, "fork"):
        return "tvist's fixtures need Linux or macOS: this system has no fork"
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        return (
            f"tvist's fixtures need the server's packages ({', '.join(missing)} "
            f"{'is' if len(missing) == 1 else 'are'} missing): pip install 'tvist[testing]'"
        )
    return None


def _line(connection: socket.socket) -> dict[str, Any]:
    """Return the next line of JSON; empty if the connection has ended."""
    with connection.makefile("rb") as stream:
        line = stream.readline()
    content: dict[str, Any] = json.loads(line) if line.endswith(b"\n") else {}
    return content

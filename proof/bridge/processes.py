"""The processes of a trial: a robot, and the bridge that moves it."""

import contextlib
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Self

from tvist_client import RefusedError
from tvist_client.blocking import Robot
from tvist_client.blocking_classes import Arm
from tvist_lab.served import free_endpoint
from tvist_protocol.modes import RobotMode

BEGINS = 120.0
"""Longest start of a server, which may have to compile [s]."""


class Server:
    """`tvist serve` in a process of its own.

    Args:
        name: Name of its robot.
        options: Further options.
    """

    def __init__(self, name: str, *options: str) -> None:
        self.name, self.endpoint, self._lines = name, free_endpoint(), list[str]()
        where = "--name", name, "--listen", self.endpoint
        command = [sys.executable, "-m", "tvist_cli", "serve", *where, *options]
        self._process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()

    def _read(self) -> None:
        assert self._process.stderr is not None
        self._lines.extend(iter(self._process.stderr.readline, ""))

    @property
    def said(self) -> str:
        """What it has said to people."""
        return "".join(self._lines)

    def connect(self) -> "contextlib.AbstractContextManager[Robot]":
        """Return a client, when it has begun.

        Raises:
            RuntimeError: It has ended instead.
        """
        deadline = time.monotonic() + BEGINS
        while "listens " not in self.said:
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"{self.name} did not begin: {self.said}")
            time.sleep(0.01)
        return Robot.connect(self.endpoint, self.name)

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self._process.send_signal(number)


def hidden_robot(address: str, seed: int, speed: float = 1.0) -> Server:
    """Return a robot that shapes nothing, at an IP address, with what a seed hides, and a speed of its time."""
    real = "--profile", "real", "--shaper", "none", "--speed", f"{speed:g}"
    return Server("arm", "--ur", "--ur-address", address, *real, "--hidden", str(seed))


def bridge_to(address: str) -> Server:
    """Return a bridge that moves the robot at an IP address."""
    return Server("bridge", "--plant", f"ur://{address}", "--enable-motion")


def until_held(robot: Robot, arm: Arm, speed: float) -> None:
    """Move by nothing at a speed [rad/s], after a stop for which nobody was the cause once it is over."""

    def hold() -> None:
        if robot.state().robot_mode != RobotMode.RUNNING:
            arm.power_on()
        arm.move_j(robot.state().target_q, velocity=speed)

    until_done(hold)


def until_done(do: Callable[[], object], seconds: float = 30.0) -> None:
    """Ask for something again until it is not refused.

    Raises:
        RefusedError: It is still refused after some seconds.
    """
    deadline = time.monotonic() + seconds
    while True:
        try:
            do()
        except RefusedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
        else:
            return

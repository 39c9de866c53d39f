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
from tvist_lab.served import free_endpoint

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
        command = [
            sys.executable,
            "-m",
            "tvist_cli",
            "serve",
            "--name",
            name,
            "--listen",
            self.endpoint,
            *options,
        ]
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

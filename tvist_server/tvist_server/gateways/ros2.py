"""Starts `tvist ros2` for a robot, in a process of its own."""

import asyncio
import subprocess
import sys

from tvist_server.gateways.base import Gateway


class Ros2Gateway(Gateway):
    """Connects a robot with ROS 2 while it is served."""

    wanted_topics = frozenset()  # the process is a client like any other

    def __init__(self, endpoint: str, robot: str, namespace: str) -> None:
        self._command = [sys.executable, "-m", "tvist_cli", "ros2", endpoint, "--name", robot]
        self._command += ["--namespace", namespace.replace("-", "_")] if namespace else []
        self._process: subprocess.Popen[bytes] | None = None

    async def open(self) -> None:
        # In a session of its own, so that the terminal's Control+C reaches the server alone.
        self._process = subprocess.Popen(self._command, stdin=subprocess.DEVNULL, start_new_session=True)  # noqa: S603, ASYNC220  it is this program, and starts at once

    async def shut(self) -> None:
        if self._process is not None:
            self._process.kill()  # it keeps nothing
            await asyncio.to_thread(self._process.wait)

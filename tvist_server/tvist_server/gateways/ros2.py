"""Starts `tvist ros2` for a robot, in a process of its own."""

import asyncio
import sys
from asyncio.subprocess import DEVNULL
from collections.abc import Callable
from contextlib import suppress

from tvist_server.gateways.base import Gateway


class Ros2Gateway(Gateway):
    """Connects a robot with ROS 2 while it is served."""

    wanted_topics = frozenset()  # the process is a client like any other

    def __init__(self, endpoint: str, robot: str, namespace: str, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._command = [sys.executable, "-m", "tvist_cli", "ros2", endpoint, "--name", robot]
        self._command += ["--namespace", namespace.replace("-", "_")] if namespace else []
        self._running: asyncio.Task[None] | None = None

    async def open(self) -> None:
        self._running = asyncio.create_task(self._run())

    async def _run(self) -> None:
        try:
            # In a session of its own, so that the terminal's Control+C reaches the server alone.
            process = await asyncio.create_subprocess_exec(
                *self._command, stdin=DEVNULL, start_new_session=True
            )
        except OSError as error:
            self._warn(f"ROS 2 does not see the robot: tvist ros2 did not start: {error}")
            return
        try:
            code = await process.wait()
            self._warn(f"ROS 2 does not see the robot any longer: tvist ros2 has ended with exit code {code}")
        except asyncio.CancelledError:
            with suppress(ProcessLookupError):
                process.kill()  # it keeps nothing
            await process.wait()

    async def shut(self) -> None:
        if self._running is not None:
            self._running.cancel()
            await asyncio.wait([self._running])

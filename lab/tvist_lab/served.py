"""Serve a robot in a separate process, as a user would start it."""

import asyncio
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from tvist_client.robot import Robot
from tvist_protocol.errors import TvistError

_BIND = "import os, sys; os.sched_setaffinity(0, {int(sys.argv[1])}); os.execv(sys.argv[2], sys.argv[2:])"
"""Binds its process to a processor, then executes the given program."""
PATIENCE = 300.0
"""Longest wait for a robot's first answer [s]; a cold start compiles, which takes minutes on a slow machine."""


class ServedError(RuntimeError):
    """The served robot did not start, or failed at its end."""


def free_port() -> int:
    """Return a free TCP port of 127.0.0.1."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def free_endpoint() -> str:
    """Return a free endpoint on this machine."""
    return f"tcp/127.0.0.1:{free_port()}"


@dataclass(frozen=True)
class RunningServer:
    """A server that has answered."""

    endpoint: str
    pid: int
    took: float  # time from the start until the first answer [s]
    robot: Robot  # client of the robot, or of the first of several


@asynccontextmanager
async def served(
    options: Sequence[str],
    name: str = "ur5e",
    *,
    several: bool = False,
    core: int | None = None,
    patience: float = PATIENCE,
) -> AsyncIterator[RunningServer]:
    """Run `tvist serve` with options and connect a client; at the end, send SIGTERM and check the exit code.

    `name` is that of the robot, or with `several` of one that the options name; `core` is the processor to
    bind the server to; `patience` limits the wait for the first answer [s]. Raises ServedError if the server
    does not answer, or its exit code is not 0.
    """
    endpoint = free_endpoint()
    named = () if several else ("--name", name)
    serve = [sys.executable, "-m", "tvist_cli", "serve", "--listen", endpoint, *named, *options]
    bound = [] if core is None else [sys.executable, "-c", _BIND, str(core)]
    loop = asyncio.get_running_loop()
    began = loop.time()
    process = await asyncio.create_subprocess_exec(*bound, *serve, stderr=subprocess.PIPE)
    assert process.stderr is not None
    told: list[bytes] = []
    reading = asyncio.create_task(_read(process.stderr, told))
    try:
        async with await _connect(process, endpoint, name, told, patience) as robot:
            yield RunningServer(endpoint, process.pid, loop.time() - began, robot)
    finally:
        if process.returncode is None:
            process.terminate()
        code = await process.wait()
        await reading
    if code != 0:
        raise ServedError(f"tvist serve ended with exit code {code}: {_last(told)}")


@asynccontextmanager
async def served_robot(options: Sequence[str], name: str = "ur5e") -> AsyncIterator[tuple[Robot, str]]:
    """Serve one robot, see `served`; yield its client and endpoint."""
    async with served(options, name) as server:
        yield server.robot, server.endpoint


async def _connect(
    process: asyncio.subprocess.Process, endpoint: str, name: str, told: list[bytes], patience: float
) -> Robot:
    deadline = asyncio.get_running_loop().time() + patience
    while True:
        try:
            return await Robot.connect(endpoint, name)
        except TvistError as error:  # the robot is not there, or reports that it is starting
            if process.returncode is not None:
                raise ServedError(
                    f"tvist serve ended with exit code {process.returncode}: {_last(told)}"
                ) from error
            if asyncio.get_running_loop().time() > deadline:
                raise ServedError(f"tvist serve does not answer on {endpoint}: {error}") from error
            await asyncio.sleep(0.05)


async def _read(stream: asyncio.StreamReader, lines: list[bytes]) -> None:
    while line := await stream.readline():
        lines.append(line)


def _last(lines: list[bytes]) -> str:
    return b"".join(lines[-3:]).decode(errors="replace").strip() or "it said nothing"

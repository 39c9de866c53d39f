"""A robot served by a process of its own, as a user would start it."""

import asyncio
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from tvist_client.errors import ClientError
from tvist_client.robot import Robot

_BIND = "import os, sys; os.sched_setaffinity(0, {int(sys.argv[1])}); os.execv(sys.argv[2], sys.argv[2:])"
"""Binds itself to a processor, and becomes the program behind."""
PATIENCE = 300.0
"""How long a robot may take to answer at first [s]: a cold start compiles, on a slow machine for minutes."""


class ServedError(RuntimeError):
    """The served robot did not come up, or did not end well."""


def free_port() -> int:
    """A TCP port of 127.0.0.1 that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def free_endpoint() -> str:
    """An endpoint on this machine that nobody listens on."""
    return f"tcp/127.0.0.1:{free_port()}"


@dataclass(frozen=True)
class Served:
    """A server that answers."""

    endpoint: str
    pid: int
    took: float
    """From its start until it answered [s]."""
    robot: Robot
    """A client of the robot, or the first of several."""


@asynccontextmanager
async def served(
    options: Sequence[str],
    name: str = "ur5e",
    *,
    several: bool = False,
    core: int | None = None,
    patience: float = PATIENCE,
) -> AsyncIterator[Served]:
    """`tvist serve` with options, and a client of it; SIGTERM and a clean exit at the end.

    Args:
        options: Options of `tvist serve`, besides the endpoint.
        name: The robot's name, or that of one of several.
        several: Whether the options name the robots.
        core: Processor the server is bound to.
        patience: How long it may take to answer at first [s].

    Raises:
        ServedError: It does not answer, or its exit code is not 0.
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
            yield Served(endpoint, process.pid, loop.time() - began, robot)
    finally:
        if process.returncode is None:
            process.terminate()
        code = await process.wait()
        await reading
    if code != 0:
        raise ServedError(f"tvist serve ended with exit code {code}: {_last(told)}")


@asynccontextmanager
async def served_robot(options: Sequence[str], name: str = "ur5e") -> AsyncIterator[tuple[Robot, str]]:
    """Serve one robot, see `served`; gives a client of it and its endpoint.

    Raises:
        ServedError: It does not answer, or its exit code is not 0.
    """
    async with served(options, name) as server:
        yield server.robot, server.endpoint


async def _connect(
    process: asyncio.subprocess.Process, endpoint: str, name: str, told: list[bytes], patience: float
) -> Robot:
    deadline = asyncio.get_running_loop().time() + patience
    while True:
        try:
            return await Robot.connect(endpoint, name)
        except ClientError as error:
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

"""A robot served by a process of its own, as a user would start it."""

import asyncio
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

from tvist_client.errors import ClientError
from tvist_client.robot import Robot

PATIENCE = 60.0
"""How long a robot may take to answer at first [s]: a cold start compiles."""


class ServedError(RuntimeError):
    """The served robot did not come up, or did not end well."""


def free_endpoint() -> str:
    """An endpoint on this machine that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@asynccontextmanager
async def served_robot(options: Sequence[str], name: str = "ur5e") -> AsyncIterator[tuple[Robot, str]]:
    """`tvist serve` with options, a client of it, and its endpoint; SIGTERM and a clean exit at the end.

    Raises:
        ServedError: It does not answer, or its exit code is not 0.
    """
    endpoint = free_endpoint()
    command = [sys.executable, "-m", "tvist_cli", "serve", "--listen", endpoint, "--name", name, *options]
    process = await asyncio.create_subprocess_exec(*command, stderr=subprocess.PIPE)
    assert process.stderr is not None
    told: list[bytes] = []
    reading = asyncio.create_task(_read(process.stderr, told))
    try:
        async with await _connect(process, endpoint, name, told) as robot:
            yield robot, endpoint
    finally:
        if process.returncode is None:
            process.terminate()
        code = await process.wait()
        await reading
    if code != 0:
        raise ServedError(f"tvist serve ended with exit code {code}: {_last(told)}")


async def _connect(process: asyncio.subprocess.Process, endpoint: str, name: str, told: list[bytes]) -> Robot:
    deadline = asyncio.get_running_loop().time() + PATIENCE
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

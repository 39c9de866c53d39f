"""Helpers of a measurement in processes of their own, which end with their stdin: readers, and others."""

import json
import sys
from asyncio.subprocess import PIPE, Process, create_subprocess_exec
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


@asynccontextmanager
async def helper(module: str, *arguments: str) -> AsyncIterator[Process]:
    """Run a module of this package, and end it by the end of its stdin.

    Args:
        module: Name of the module.
        arguments: Arguments of the module.
    """
    command = [sys.executable, "-m", f"proof.bench.{module}", *arguments]
    # In a session of its own, Control+C leaves it to whoever measures.
    process = await create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE, start_new_session=True)
    try:
        yield process
        if process.returncode is None:
            await process.communicate(b"")
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


@asynccontextmanager
async def readers(module: str, *arguments: str) -> AsyncIterator[list[dict[str, int]]]:
    """Run a module of this package that prints a line when its clients read, and another when its stdin ends.

    Args:
        module: Name of the module, `observers` or `rtde_clients`.
        arguments: Arguments of the module.

    Yields:
        A list, which at the end contains the numbers received and lost of each client.
    """
    said: list[dict[str, int]] = []
    async with helper(module, *arguments) as process:
        assert process.stdout is not None
        await process.stdout.readline()  # all clients are reading
        yield said
        out, _ = await process.communicate(b"")
        said += json.loads(out)

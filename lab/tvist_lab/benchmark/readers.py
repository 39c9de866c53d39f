"""Clients that only read, in a process of their own: what they say at their end."""

import asyncio
import json
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


@asynccontextmanager
async def readers(module: str, *arguments: str) -> AsyncIterator[list[dict[str, int]]]:
    """Run a module of this package that says a line when its clients read, and another when its stdin ends.

    Args:
        module: Its name, `observers` or `rtde_clients`.
        arguments: Arguments of the module.

    Yields:
        A list, in which stands at the end what each client received and lost.
    """
    command = [sys.executable, "-m", f"tvist_lab.benchmark.{module}", *arguments]
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe)
    said: list[dict[str, int]] = []
    try:
        assert process.stdout is not None
        await process.stdout.readline()  # they all read
        yield said
        out, _ = await process.communicate(b"")  # which ends its stdin
        said += json.loads(out)
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()

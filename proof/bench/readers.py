"""Clients that only read, in a separate process, and their final counts."""

import asyncio
import json
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


@asynccontextmanager
async def readers(module: str, *arguments: str) -> AsyncIterator[list[dict[str, int]]]:
    """Run a module of this package that prints a line when its clients read, and another when its stdin ends.

    Args:
        module: Name of the module, `observers` or `rtde_clients`.
        arguments: Arguments of the module.

    Yields:
        A list, which at the end contains the numbers received and lost of each client.
    """
    command = [sys.executable, "-m", f"proof.bench.{module}", *arguments]
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe)
    said: list[dict[str, int]] = []
    try:
        assert process.stdout is not None
        await process.stdout.readline()  # all clients are reading
        yield said
        out, _ = await process.communicate(b"")  # closes its stdin
        said += json.loads(out)
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()

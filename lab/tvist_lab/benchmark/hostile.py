"""Lateness of ticks while a client sends messages of every kind, compared in turn with quiet runs."""

import asyncio
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from tvist_lab.benchmark.in_turn import in_turn
from tvist_lab.served import Served, served

RATE = 100.0
"""Messages per second."""


async def hostile(pairs: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a served robot in pairs of runs, one quiet and one with a sender; see `in_turn`.

    Args:
        pairs: Number of pairs.
        seconds: Duration of each run [s].
        tell: Called with a description of each measurement before it starts.
    """
    async with served([]) as server:
        figures = await in_turn(server, _sender, pairs, seconds, "messages", tell)
    return figures | {"messages_per_second": RATE}


@asynccontextmanager
async def _sender(server: Served, seed: int) -> AsyncIterator[None]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tvist_lab.benchmark.sender", server.endpoint, str(RATE), str(seed),
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert await process.stdout.readline() == b"ready\n", "the sender did not begin"
        yield
    finally:
        process.stdin.close()
        await process.wait()

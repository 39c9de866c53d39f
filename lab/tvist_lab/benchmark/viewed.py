"""A robot that is watched on the page of `tvist view`: pictures per second, and what the watching costs."""

import asyncio
import json
import re
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from statistics import mean
from typing import Any

import numpy as np

from tvist_client.errors import ClientError
from tvist_lab.benchmark.in_turn import in_turn
from tvist_lab.benchmark.process import cpu_seconds, rss_mb
from tvist_lab.served import Served, served
from tvist_protocol.errors import RefusedError

SLOW = 0.2
"""Velocity with which the arm goes to and fro meanwhile, so that every picture differs [rad/s]."""
WARM = 0.2
"""Share of a run after which memory is looked at [-]."""


async def viewed(pairs: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot whose arm moves, in pairs of runs, one unwatched and one with a page and a tab; see `in_turn`.

    Args:
        pairs: Number of pairs.
        seconds: Duration of each run [s].
        tell: Called with a description of each measurement before it starts.

    Returns:
        The figures of `in_turn`, messages per second that a tab receives, the page's share of a core, its memory [MB]
        and the slope of its memory over a run [MB/min].
    """
    pages: list[dict[str, float]] = []

    @asynccontextmanager
    async def page(server: Served, _: int) -> AsyncIterator[None]:
        async with _page(server.endpoint) as (pid, reader):
            samples: list[tuple[float, float]] = []
            watching = asyncio.create_task(_memory(pid, samples))
            loop = asyncio.get_running_loop()
            began, used = loop.time(), cpu_seconds(pid)
            yield
            share = (cpu_seconds(pid) - used) / (loop.time() - began)
            watching.cancel()
            reader.stdin.close()  # type: ignore[union-attr]  # piped
            said = await reader.stdout.read()  # type: ignore[union-attr]
            warm = np.array(samples[round(WARM * len(samples)) :])
            pages.append(
                {
                    "per_second": json.loads(said)["per_second"],
                    "cpu_share": share,
                    "rss_mb": rss_mb(pid),
                    "slope": float(np.polyfit(warm[:, 0] / 60.0, warm[:, 1], 1)[0])
                    if len(warm) > 2
                    else np.nan,
                }
            )

    async with served(["--truth"]) as server:
        moving = asyncio.create_task(_to_and_fro(server))
        try:
            figures = await in_turn(server, page, pairs, seconds, "a page", tell)
        finally:
            moving.cancel()
            with suppress(asyncio.CancelledError):
                await moving
    return figures | {
        "messages_per_second": min(one["per_second"] for one in pages),
        "page_cpu_share": mean(one["cpu_share"] for one in pages),
        "page_rss_mb": max(one["rss_mb"] for one in pages),
        "page_rss_mb_per_minute": mean(one["slope"] for one in pages),
    }


async def _to_and_fro(server: Served) -> None:
    with suppress(ClientError, RefusedError):
        async with server.robot.control("bench") as arm:
            start = (await server.robot.state()).target_q
            while True:
                for angle in (0.5, 0.0):
                    await arm.move_j([start[0] - angle, *start[1:]], velocity=SLOW)


async def _memory(pid: int, samples: list[tuple[float, float]]) -> None:
    loop = asyncio.get_running_loop()
    while True:
        samples.append((loop.time(), rss_mb(pid)))
        await asyncio.sleep(1.0)


@asynccontextmanager
async def _page(endpoint: str) -> AsyncIterator[tuple[int, asyncio.subprocess.Process]]:
    """A page of a robot, and a tab that reads it: the page's process and the reader."""
    pipe = asyncio.subprocess.PIPE
    view = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tvist_cli", "view", endpoint, "--port", "0", stderr=pipe
    )
    assert view.stderr is not None
    try:
        line = (await view.stderr.readline()).decode()
        found = re.search(r":(\d+)", line)
        if found is None:
            raise RuntimeError(f"tvist view did not start: {line.strip()}")
        reader = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "tvist_lab.benchmark.page_reader", found.group(1), stdin=pipe, stdout=pipe
        )
        assert reader.stdout is not None
        assert await reader.stdout.readline() == b"ready\n", "the page was not read"
        try:
            yield view.pid, reader
        finally:
            if reader.returncode is None and reader.stdin is not None:
                reader.stdin.close()
            await reader.wait()
    finally:
        view.terminate()
        await view.wait()

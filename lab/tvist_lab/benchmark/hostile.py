"""Lateness of ticks while a client sends messages of every kind, compared in turn with quiet runs."""

import asyncio
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
from scipy import stats

from tvist_lab.benchmark.one_robot import punctuality
from tvist_lab.served import Served, served

RATE = 100.0
"""Messages per second."""
CONFIDENCE = 0.95


async def hostile(pairs: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a served robot in pairs of runs, one quiet and one with a sender, in alternating order.

    Args:
        pairs: Number of pairs.
        seconds: Duration of each run [s].
        tell: Called with a description of each measurement before it starts.

    Returns:
        For p99 of the lateness [µs] and for missed ticks per run: means without and with messages, and the mean
        difference with the half-width of its 95 % interval (Student, over pairs).
    """
    found: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    async with served([]) as server:
        await server.robot.state()
        for pair in range(pairs):
            for loaded in (False, True) if pair % 2 == 0 else (True, False):
                tell(f"pair {pair + 1} of {pairs}, {'with' if loaded else 'without'} messages")
                found[loaded].append(await _run(server, seconds, seed=pair if loaded else None))
    quiet, load = (np.array(found[loaded]) for loaded in (False, True))
    return {
        "pairs": pairs,
        "seconds": seconds,
        "messages_per_second": RATE,
        "late_p99_us": _compare(quiet[:, 0], load[:, 0]),
        "missed": _compare(quiet[:, 1], load[:, 1]),
    }


async def _run(server: Served, seconds: float, seed: int | None) -> tuple[float, float]:
    if seed is None:
        tick, _ = await punctuality(server, seconds)
    else:
        async with _sender(server.endpoint, seed):
            tick, _ = await punctuality(server, seconds)
    return tick["late_p99_us"], tick["missed"]


@asynccontextmanager
async def _sender(endpoint: str, seed: int) -> AsyncIterator[None]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tvist_lab.benchmark.sender", endpoint, str(RATE), str(seed),
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


def _compare(without: np.ndarray[Any, Any], loaded: np.ndarray[Any, Any]) -> dict[str, float]:
    difference = loaded - without
    spread = float(difference.std(ddof=1) / np.sqrt(len(difference))) if len(difference) > 1 else float("nan")
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, len(difference) - 1)) * spread
    return {
        "without": float(without.mean()),
        "with": float(loaded.mean()),
        "difference": float(difference.mean()),
        "interval": half,
    }

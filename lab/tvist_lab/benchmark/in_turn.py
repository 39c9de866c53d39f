"""Lateness of a served robot's ticks with and without a load, in pairs of runs in alternating order."""

from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any

import numpy as np
from scipy import stats

from tvist_lab.benchmark.one_robot import punctuality
from tvist_lab.served import Served

CONFIDENCE = 0.95

Load = Callable[[Served, int], AbstractAsyncContextManager[None]]
"""Puts a load on a robot for as long as its block lasts; the number is that of the pair."""


async def in_turn(
    server: Served, load: Load, pairs: int, seconds: float, what: str, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Measure a served robot in pairs of runs, one without and one with a load.

    Args:
        server: The robot.
        load: The load.
        pairs: Number of pairs.
        seconds: Duration of each run [s].
        what: The load in a word or two.
        tell: Called with a description of each measurement before it starts.

    Returns:
        For p99 of the lateness [µs] and for missed ticks per run: means without and with the load, and the mean
        difference with the half-width of its 95 % interval (Student, over pairs).
    """
    found: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    await server.robot.state()
    for pair in range(pairs):
        for loaded in (False, True) if pair % 2 == 0 else (True, False):
            tell(f"pair {pair + 1} of {pairs}, {'with' if loaded else 'without'} {what}")
            if loaded:
                async with load(server, pair):
                    tick, _ = await punctuality(server, seconds)
            else:
                tick, _ = await punctuality(server, seconds)
            found[loaded].append((tick["late_p99_us"], tick["missed"]))
    quiet, load_figures = (np.array(found[loaded]) for loaded in (False, True))
    return {
        "pairs": pairs,
        "seconds": seconds,
        "late_p99_us": _compare(quiet[:, 0], load_figures[:, 0]),
        "missed": _compare(quiet[:, 1], load_figures[:, 1]),
    }


def _compare(without: np.ndarray[Any, Any], loaded: np.ndarray[Any, Any]) -> dict[str, float]:
    difference, half = mean_and_interval(loaded - without)
    return {
        "without": float(without.mean()),
        "with": float(loaded.mean()),
        "difference": difference,
        "interval": half,
    }


def mean_and_interval(values: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Return the mean of independent values and the half-width of its 95 % interval (Student); nan for one value."""
    spread = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
    return float(values.mean()), float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, len(values) - 1)) * spread

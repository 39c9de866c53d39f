"""Seeds reserved for evaluation, numbers of moves, and bootstrap intervals."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np
import polars as pl

from tvist_lab.recordings import Floats
from tvist_lab.study.columns import of_group

TUNING = range(100)
"""Seeds of moves and arms on which shapers may be tuned; no published table uses them. For shapers older than
this rule (2026-11-26), the seeds are not known."""
JUDGING = MappingProxyType(
    {
        "elastic": 20261127,
        "elastic with wrong beliefs": 20261124,
        "shaperbench": 20261125,
        "robustness": 20261123,
    }
)  # seeds of published tables: nothing is tuned on them
MOVES = 60  # number of moves for each cell of a published table, and the default
MIN_MOVES = 20
"""Smallest number of moves for a verdict and for a 5th percentile, which is otherwise little more than the
worst move."""
RESAMPLED = 2000


def said(seed: int) -> str:
    """Return a page's statement about its seed."""
    tuned = f"seeds {TUNING.start} to {TUNING.stop - 1}"
    if seed in TUNING:
        return f"Seed {seed} is a tuning seed ({tuned}), so these moves are not held out."
    return f"Nothing is tuned on seed {seed}: shapers may be tuned on {tuned}."


def interval(values: Floats, percentile: float) -> list[float] | None:
    """Return the 95 % bootstrap interval of a percentile; None if there are no values."""
    return bootstrap(values, lambda drawn: np.percentile(drawn, percentile, axis=1))


def bootstrap(values: Floats, statistic: Callable[[Floats], Floats]) -> list[float] | None:
    """Return the 95 % interval of a statistic by resampling rows (percentile bootstrap); None if there are none.

    `values` has shape (T, ...); `statistic` maps samples of shape (S, T, ...) to values of shape (S,).
    """
    if not values.size:
        return None
    drawn = values[np.random.default_rng(0).integers(0, len(values), (RESAMPLED, len(values)))]
    low, high = np.percentile(statistic(drawn), [2.5, 97.5])
    return [float(low), float(high)]


def interval_of(name: str, percentile: float, called: str, least: int = 0) -> pl.Expr:
    """Return an expression for the 95 % bootstrap interval of a percentile, null for fewer than `least` rows."""

    def of(values: Floats) -> list[float] | None:
        return interval(values, percentile) if len(values) >= least else None

    return of_group(of, [pl.col(name)], pl.List(pl.Float64), f"{name}_{called}_interval")

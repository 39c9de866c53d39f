"""A figure beside its reference from the same run, compared by medians over repetitions in alternating order."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray
from scipy import stats

from tvist_lab.bench.moving import Run

CONFIDENCE = 0.95

Floats = NDArray[np.float64]


class Figure(Struct, frozen=True, kw_only=True):
    """One figure and its reference."""

    what: str
    """What is measured."""
    value: float
    """Median over the repetitions."""
    unit: str
    """Unit of value and reference; "" for a number."""
    reference: str
    """What it is compared with."""
    reference_value: float
    """Median of the reference over the same repetitions."""
    compared: float | None
    """Median of value / reference; None if a reference is 0."""
    low: float | None = None
    """Lower end of the interval of `compared`; None after one repetition."""
    high: float | None = None
    """Upper end of that interval."""
    repetitions: int
    """Number of repetitions, in each of which both were measured."""


def figure(
    what: str, unit: str, values: Sequence[float], reference: str, references: Sequence[float]
) -> Figure:
    """Compare what several repetitions gave.

    Args:
        what: What is measured.
        unit: Unit of values and references.
        values: The figure in each repetition.
        reference: What it is compared with.
        references: The reference in the same repetitions.
    """
    ours, theirs = np.array(values, dtype=float), np.array(references, dtype=float)
    compared, low, high = median_interval(ours / theirs) if np.all(theirs > 0.0) else (None, None, None)
    return Figure(
        what=what,
        value=float(np.median(ours)),
        unit=unit,
        reference=reference,
        reference_value=float(np.median(theirs)),
        compared=compared,
        low=low,
        high=high,
        repetitions=len(ours),
    )


def median_interval(values: Floats) -> tuple[float, float | None, float | None]:
    """Return the median of independent values and its 95 % interval, which holds for any distribution.

    Its ends are the k-th smallest and the k-th largest value, with the largest k for which a binomial variable of n
    trials with probability 1/2 is below k with a probability of at most 2.5 %. Fewer than six values have no such k:
    the ends are then the smallest and the largest value, and None for a single value.
    """
    ordered = np.sort(values)
    count = len(ordered)
    if count == 1:
        return float(ordered[0]), None, None
    # `ppf` gives the smallest k with P(X <= k) >= 2.5 %, so P(X < k) is below that.
    place = max(int(stats.binom.ppf((1.0 - CONFIDENCE) / 2.0, count, 0.5)), 1)
    return float(np.median(ordered)), float(ordered[place - 1]), float(ordered[-place])


def in_alternation(runs: Mapping[str, Run], repetitions: int) -> dict[str, list[float]]:
    """Measure several things in turn, forwards and backwards, so that a machine whose speed drifts decides nothing.

    Args:
        runs: What measures each once. Each runs once before, for what happens only at first.
        repetitions: Number of times that each is measured.

    Returns:
        The results of each.
    """
    names = list(runs)
    for run in runs.values():
        run()
    found: dict[str, list[float]] = {name: [] for name in names}
    for repetition in range(repetitions):
        for name in names if repetition % 2 == 0 else reversed(names):
            found[name].append(runs[name]())
    return found

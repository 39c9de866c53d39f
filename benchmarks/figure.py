"""A figure and its reference from the same run, compared by medians over repetitions in alternating order."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct
from scipy import stats

from tvist_lab.bench.moving import Run
from tvist_lab.recordings import Floats

CONFIDENCE = 0.95
Tell = Callable[[str], None]  # receives a description of each measurement before it starts


class Figure(Struct, frozen=True, kw_only=True):
    """One figure and its reference."""

    what: str
    value: float  # median over the repetitions
    unit: str
    reference: str  # name of what it is compared with
    reference_value: float  # median of the reference over the same repetitions
    compared: float | None  # median of value / reference; None if a reference is 0
    low: float | None
    high: float | None  # ends of its 95 % interval; None after one repetition
    repetitions: int  # number of repetitions; each measured both


def figure(
    what: str, unit: str, values: Sequence[float], reference: str, references: Sequence[float]
) -> Figure:
    """Compare the results of several repetitions."""
    ours, theirs = np.array(values, dtype=float), np.array(references, dtype=float)
    compared, low, high = median_interval(ours / theirs) if np.all(theirs > 0.0) else (None, None, None)
    return Figure(
        what=what, value=float(np.median(ours)), unit=unit,
        reference=reference, reference_value=float(np.median(theirs)),
        compared=compared, low=low, high=high, repetitions=len(ours),
    )  # fmt: skip


def median_interval(values: Floats) -> tuple[float, float | None, float | None]:
    """Return the median of independent values and its 95 % interval, which holds for any distribution.

    Its ends are the k-th smallest and largest value, with the largest k for which a binomial variable of n
    trials with probability 1/2 is below k with at most 2.5 %; for fewer than six values k is 1.
    """
    ordered = np.sort(values)
    count = len(ordered)
    if count == 1:
        return float(ordered[0]), None, None
    # `ppf` gives the smallest k with P(X <= k) >= 2.5 %, so P(X < k) is below that.
    place = max(int(stats.binom.ppf((1.0 - CONFIDENCE) / 2.0, count, 0.5)), 1)
    return float(np.median(ordered)), float(ordered[place - 1]), float(ordered[-place])


def in_alternation(runs: Mapping[str, Run], repetitions: int) -> dict[str, list[float]]:
    """Run measurements in turn, forwards and backwards, so that a drift of the machine's speed cancels out.

    Each measurement runs once beforehand, to exclude one-time costs.
    """
    names = list(runs)
    for run in runs.values():
        run()
    found: dict[str, list[float]] = {name: [] for name in names}
    for repetition in range(repetitions):
        for name in names if repetition % 2 == 0 else reversed(names):
            found[name].append(runs[name]())
    return found

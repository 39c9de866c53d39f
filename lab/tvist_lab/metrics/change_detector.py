"""Sequential test whether a quantity measured once per motion has changed."""

import math
from dataclasses import dataclass

import numpy as np

from tvist_lab.recordings import Floats

WINDOWS = (2, 3, 5, 8)
"""Numbers of last measurements compared with earlier ones: one may be an outlier, small changes need many."""
MIN_MEASUREMENTS = 3  # number of earlier measurements that a comparison needs
KEPT = 40
SURE_DEVIATIONS = 3.7
"""Standard deviations beyond which a change is reported if the scatter is known well. For normal measurements
this would be one false report in 5,000; measurements of real motions have heavier tails."""
SHOWN, CLEAR = 2.0, 2.5  # half interval in messages, and smallest change, both in standard errors
FARTHEST = 3.5  # number of its deviations to which a measurement's distance from earlier ones is clipped
BELIEVED = 4.0  # number of measurements that have as much weight as the expected scatter
OUTLYING = 2.5  # number of deviations beyond which an earlier measurement loses weight


@dataclass(frozen=True)
class DetectedChange:
    """A change of the measured quantity."""

    before: float
    after: float
    error: float  # standard error of the difference
    lasting: int  # number of measurements since the change, including the newest


class ChangeDetector:
    """Compares the latest measurements of a quantity with all before, each with its own error.

    Change-point model: the means before and after a change are unknown, and the likeliest moment of a change
    is taken (Hawkins, Qiu and Kang, J. Quality Technology 35, 2003). Scatter between motions beyond the
    errors is estimated from earlier measurements and its expectation; outliers have less weight (Huber,
    Annals of Mathematical Statistics 35, 1964). After a reported change, earlier measurements are forgotten.

    `prior` is the standard deviation of the mean about 0 before any measurement, `scatter` the expected
    standard deviation between motions beyond measurement errors, `least` the smallest change to report.
    """

    def __init__(self, prior: float, scatter: float, least: float) -> None:
        self._prior, self._scatter, self._least = prior, scatter, least
        self._kept: list[tuple[float, float]] = []

    def take(self, value: float, error: float) -> DetectedChange | None:
        """Add a measurement and its standard error; return the change that is detected now, if any."""
        self._kept = [*self._kept[1 - KEPT :], (value, error)]
        found, surest = None, 0.0
        for number in WINDOWS:
            past = len(self._kept) - number
            if past < MIN_MEASUREMENTS:
                break
            mean, scatter, variance = self._past(np.array(self._kept[:past]))
            latest, errors = np.array(self._kept[past:]).T
            own = errors**2 + scatter**2
            farthest = FARTHEST * np.sqrt(own + variance)
            moved = float(np.average(np.clip(latest - mean, -farthest, farthest), weights=1.0 / own))
            error_of_it = float(np.sqrt(1.0 / np.sum(1.0 / own) + variance))
            # With few measurements the scatter is uncertain, so require a larger change.
            sure = SURE_DEVIATIONS * math.sqrt(1.0 + BELIEVED / (BELIEVED + past))
            if abs(moved) > max(max(sure, surest) * error_of_it, self._least):
                off = (latest - mean) * np.sign(moved)
                new = off > 0.5 * off.max()  # a window may begin before the change
                after = float(np.average(latest[new], weights=1.0 / own[new]))
                error_since = float(np.sqrt(1.0 / np.sum(1.0 / own[new]) + variance))
                surest, found = (
                    abs(moved) / error_of_it,
                    DetectedChange(mean, after, error_since, int(new.sum())),
                )
                if abs(after - mean) < CLEAR * error_since:  # the farthest ones alone are too uncertain
                    found = DetectedChange(mean, mean + moved, error_of_it, number)
        if found is not None:
            self._kept = self._kept[-found.lasting :]
        return found

    def _past(self, measured: Floats) -> tuple[float, float, float]:
        """Return mean, scatter between motions, and variance of the mean, of measurements of shape (n, 2)."""
        value, error = measured.T
        mean, scatter = float(np.median(value)), self._scatter
        for _ in range(3):
            own = np.sqrt(error**2 + scatter**2)
            off = np.clip(value - mean, -OUTLYING * own, OUTLYING * own)
            weight = 1.0 / own**2
            variance = 1.0 / (float(np.sum(weight)) + self._prior**-2.0)
            mean = (float(np.sum(weight * (mean + off)))) * variance
            beyond = float(np.sum(np.maximum(off**2 - error**2, 0.0)))
            scatter = float(np.sqrt((BELIEVED * self._scatter**2 + beyond) / (BELIEVED + len(value))))
        return mean, scatter, variance

"""Sequential test whether a quantity measured once per motion has changed."""

import math
from dataclasses import dataclass

import numpy as np

from tvist_lab.recordings import Floats

WINDOWS = (2, 3, 5, 8)
"""Numbers of latest measurements compared with earlier ones: one may be an outlier, small changes need more."""
MIN_MEASUREMENTS = 3  # number of earlier measurements that a comparison needs
KEPT = 40
SURE_DEVIATIONS = 3.7
"""Standard deviations beyond which a change is reported if the scatter is known well: more than normal
measurements need (1 in 5,000), since those of real motions have heavier tails."""
SHOWN, CLEAR = 2.0, 2.5  # standard errors of the interval in messages, and least of a change
FARTHEST = 3.5  # largest distance from earlier measurements that counts, in a measurement's own deviations
BELIEVED = 4.0  # number of measurements that the expected scatter is worth
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

    Change-point model: neither mean is known, and the likeliest moment of the change counts (Hawkins, Qiu and
    Kang, Journal of Quality Technology 35, 2003). Scatter between motions beyond the errors is estimated from
    earlier measurements and the expectation; outliers have less weight (Huber, Annals of Mathematical
    Statistics 35, 1964). After a reported change, the measurements since then are the new past.

    `prior` is the standard deviation of the earlier mean about 0 without any measurement, `scatter` the
    expected one between motions beyond measurement errors, `least` the smallest change to report.
    """

    def __init__(self, prior: float, scatter: float, least: float) -> None:
        self._prior, self._scatter, self._least = prior, scatter, least
        self._kept: list[tuple[float, float]] = []

    def take(self, value: float, error: float) -> DetectedChange | None:
        """Take a measurement with its standard error; return the change that it reveals, if any."""
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
                if abs(after - mean) < CLEAR * error_since:  # the farthest ones alone say too little
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

"""Time by which an arm follows its target."""

import numpy as np

from tvist_lab.recordings import Floats, Recording

LONGEST = 0.2
"""Longest lag that is searched [s]."""
FOLLOWS = 0.05
"""Largest variance of the distance that is left, over that of the target, for an arm that follows it [-]."""
FEWEST = 8
"""Smallest number of samples of a motion."""


def servo_lag(recording: Recording, start: int, stop: int) -> float | None:
    """Time by which `actual_q` follows `target_q` in one motion [s], never below zero.

    It is the shift of the target with the least squared distance from the measured angles, to a tenth of a sample.
    None if there is no column of both, or the arm does not follow the target with any lag.

    Args:
        recording: The recording.
        start: Row in which the target starts.
        stop: Row in which it stops.
    """
    if "actual_q" not in recording or "target_q" not in recording:
        return None
    time, period = recording.time, recording.period
    past = int(np.searchsorted(time, time[stop] + LONGEST))
    rows = slice(start, min(past + 1, len(time)))
    target, actual, own = recording["target_q"][rows], recording["actual_q"][rows], time[rows]
    joint = int(np.argmax(np.ptp(target, axis=0)))
    moved, followed = target[:, joint], actual[:, joint]
    seen = np.isfinite(moved) & np.isfinite(followed)
    if np.count_nonzero(seen) < FEWEST:
        return None
    own, moved, followed = own[seen], moved[seen], followed[seen]
    lags = np.arange(0.0, LONGEST, period)
    distance = np.array([_distance(own, moved, followed, lag) for lag in lags])
    best = int(np.argmin(distance))
    if distance[best] > FOLLOWS * float(np.var(moved)):
        return None
    if best == 0:
        return 0.0
    fine = lags[best] + period * np.linspace(-1.0, 1.0, 21)
    return float(min(fine, key=lambda lag: _distance(own, moved, followed, lag)))


def _distance(time: Floats, target: Floats, actual: Floats, lag: float) -> float:
    """Variance of the arm's distance from a target delayed by a lag; a constant distance does not count [rad²]."""
    return float(np.var(actual - np.interp(time - lag, time, target)))

"""Measure the time by which an arm follows its target."""

import numpy as np

from tvist_lab.metrics.vibration import SENSOR, low_pass_at
from tvist_lab.recordings import Floats, Recording

LONGEST = 0.2  # longest lag in the search [s]
FOLLOWS = 0.05
"""Largest remaining variance of the distance, relative to the target's, if the arm follows it [-]."""
LONGEST_FELT = 0.08  # longest lag in the search with the accelerometer [s]
FINE = 0.002  # longest step of that search [s]
SMOOTHED = 40.0  # cut-off frequency of the target before it is differentiated twice [Hz]
EXPLAINED = 0.5  # largest share of the accelerometer signal that may remain unexplained [-]
FEWEST = 8


def servo_lag(recording: Recording, start: int, stop: int) -> float | None:
    """Return the time by which `actual_q` follows `target_q` in a motion [s], never below zero; None if it does not.

    It is the shift of the target from row `start` to `stop` with least squared distance to the measured angles, to a
    tenth of a sample; without them, the shift with which the target's accelerations best explain the tool's.
    """
    if "target_q" not in recording:
        return None
    if "actual_q" not in recording:
        return _felt_lag(recording, start, stop)
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


def _felt_lag(recording: Recording, start: int, stop: int) -> float | None:
    """Return the lag with which the target's accelerations explain the tool's accelerometer [s]; None if none does."""
    if SENSOR not in recording:
        return None
    time, period = recording.time, recording.period
    past = min(int(np.searchsorted(time, time[stop] + LONGEST)) + 1, len(time))
    shown = start + np.flatnonzero(np.isfinite(recording[SENSOR][start:past]).all(axis=1))
    target = recording["target_q"][start:past]
    if len(shown) < 4 * FEWEST or not np.isfinite(target).all():
        return None
    own = time[start:past]
    moved = low_pass_at(own, target[:, np.ptp(target, axis=0) > 1e-3], period, SMOOTHED)
    velocity = np.gradient(moved, own, axis=0)
    acceleration = np.gradient(velocity, own, axis=0)
    felt = recording[SENSOR][shown]
    # Slow terms stand for gravity, which turns slowly in the tool's frame.
    slow = np.vander((time[shown] - own[0]) / (own[-1] - own[0]), 4)
    felt = felt - slow @ np.linalg.lstsq(slow, felt)[0]

    def left(lag: float) -> float:
        late = [np.interp(time[shown] - lag, own, axis) for axis in (*acceleration.T, *(velocity**2).T)]
        columns = np.column_stack([slow, *late])
        return float(np.sum((felt - columns @ np.linalg.lstsq(columns, felt)[0]) ** 2))

    fine = np.arange(0.0, LONGEST_FELT, min(period, FINE))
    remains = np.array([left(lag) for lag in fine])
    best = int(np.argmin(remains))
    return float(fine[best]) if remains[best] < EXPLAINED * float(np.sum(felt**2)) else None


def _distance(time: Floats, target: Floats, actual: Floats, lag: float) -> float:
    """Return the variance of the arm's distance from a delayed target [rad²]; a constant distance does not count."""
    return float(np.var(actual - np.interp(time - lag, time, target)))

"""Motions of an arm from its measured joint angles, for logs that lack the target."""

import math

import numpy as np

from tvist_lab.metrics.vibration import low_pass_at
from tvist_lab.recordings import Floats, Recording

SMOOTHED = 20.0
"""Cut-off frequency of the angles before they are differentiated [Hz]."""
SLOW = 0.01
"""A joint that is slower than this may be at rest [rad/s]."""
PAUSE = 0.1
"""Rests shorter than this belong to a motion, as at a reversal or while the arm vibrates [s]."""
SMALLEST = 0.005
"""Smallest displacement of a motion [rad]; less is vibration."""
FEWEST = 16
"""Smallest number of rows in which motions are looked for."""
TAPER = 0.03
"""Longest time for which a joint may have moved below `SLOW` before and after [s]."""


def measured_spans(recording: Recording) -> list[tuple[int, int]]:
    """First and last row of each motion of `actual_q`, in order.

    A joint moves while its speed exceeds 0.01 rad/s, or six times what the encoders' noise adds. Start and stop are
    then shifted outwards by the time in which a speed that changes steadily reaches this threshold, at most 30 ms.
    """
    seen = np.flatnonzero(np.isfinite(recording["actual_q"]).all(axis=1))
    if len(seen) < FEWEST:
        return []
    time, measured = recording.time[seen], recording["actual_q"][seen]
    q = low_pass_at(time, measured, recording.period, SMOOTHED)
    velocity = np.asarray(np.gradient(q, time, axis=0))
    speed = np.max(np.abs(velocity), axis=1)
    threshold = max(SLOW, 6.0 * _noise_of_speed(measured, recording.period))
    rows = np.flatnonzero(speed > threshold)
    if not rows.size:
        return []
    breaks = np.flatnonzero(np.diff(time[rows]) > PAUSE)
    spans = []
    for run in np.split(rows, breaks + 1):
        first, last = int(run[0]), int(run[-1])
        if np.max(np.abs(q[last] - q[first])) < SMALLEST:
            continue
        first_row = np.searchsorted(time, time[first] - _taper(time, speed, first, 1))
        last_row = np.searchsorted(time, time[last] + _taper(time, speed, last, -1))
        spans.append((int(seen[max(first_row, 1)]), int(seen[min(last_row, len(time) - 1)])))
    return spans


def _noise_of_speed(q: Floats, period: float) -> float:
    """Standard deviation of the speed that is differentiated from resting, smoothed encoders [rad/s]."""
    second = np.diff(q, n=2, axis=0)
    noise = float(np.max(np.median(np.abs(second), axis=0))) / (0.6745 * math.sqrt(6.0))
    cut_off = min(SMOOTHED, 0.45 / period)
    return noise * 2.0 * math.pi * cut_off * math.sqrt(2.0 * cut_off * period / 3.0)


def _taper(time: Floats, speed: Floats, row: int, inwards: int) -> float:
    """Time in which a speed that grows with the square of time reaches its value in a row [s]."""
    other = row + 3 * inwards
    if not 0 <= other < len(time):
        return 0.0
    slope = abs(float(speed[other] - speed[row]) / float(time[other] - time[row]))
    return min(2.0 * float(speed[row]) / slope, TAPER) if slope > 0.0 else 0.0

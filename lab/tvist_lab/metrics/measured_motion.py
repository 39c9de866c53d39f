"""Find motions in measured joint angles, for logs that lack the target."""

import math

import numpy as np
from scipy.ndimage import maximum_filter1d

from tvist_lab.metrics.vibration import low_pass_at
from tvist_lab.recordings import Floats, Recording

SMOOTHED = 20.0  # cut-off frequency of the angles before they are differentiated [Hz]
REST_SPEED = 0.01  # speed below which a joint may be at rest [rad/s]
FAST = 2.0  # smallest speed that a motion must reach, relative to the speed that ends it [-]
SWING = 0.5  # time around a fast motion in which the arm swings back from its overshoot [s]
SWUNG = 0.02  # largest speed of a joint that swings back, relative to the fastest within that time [-]
DRIVEN = 0.15  # longest time after a stop in which joints may still be driven [s]
PAUSE = 0.1  # rests shorter than this belong to a motion, as at a reversal or while the arm vibrates [s]
SMALLEST = 0.005  # smallest displacement of a motion [rad]; less is vibration
FEWEST = 16  # smallest number of rows in which motions are sought
TAPER = 0.03  # longest time for which a joint may have moved below `REST_SPEED` before and after [s]


def measured_spans(recording: Recording, name: str = "actual_q") -> list[tuple[int, int]]:
    """Return first and last row of each motion of joint angles that are never quite at rest, in order.

    A joint moves while its speed exceeds 0.01 rad/s, six times the encoders' noise, and 2 % of the fastest speed
    within half a second, which excludes swinging back. Each motion must reach twice that speed. Both ends are then
    shifted outwards by the time in which a steadily changing speed reaches this threshold, at most 30 ms.
    """
    seen = np.flatnonzero(np.isfinite(recording[name]).all(axis=1))
    if len(seen) < FEWEST:
        return []
    time, measured = recording.time[seen], recording[name][seen]
    q = low_pass_at(time, measured, recording.period, SMOOTHED)
    velocity = np.asarray(np.gradient(q, time, axis=0))
    speed = np.max(np.abs(velocity), axis=1)
    least = max(REST_SPEED, 6.0 * _noise_of_speed(measured, recording.period))
    threshold = np.maximum(least, SWUNG * maximum_filter1d(speed, 2 * round(SWING / recording.period) + 1))
    rows = np.flatnonzero(speed > threshold)
    if not rows.size:
        return []
    breaks = np.flatnonzero(np.diff(time[rows]) > PAUSE)
    spans = []
    for run in np.split(rows, breaks + 1):
        first, last = int(run[0]), int(run[-1])
        if np.max(np.abs(q[last] - q[first])) < SMALLEST or np.max(speed[run] / threshold[run]) < FAST:
            continue
        last = first + int(
            np.flatnonzero(_onwards(q, velocity, first, last) > threshold[first : last + 1])[-1]
        )
        first_row = np.searchsorted(time, time[first] - _taper(time, speed, first, 1))
        last_row = np.searchsorted(time, time[last] + _taper(time, speed, last, -1))
        spans.append((int(seen[max(first_row, 1)]), int(seen[min(last_row, len(time) - 1)])))
    return spans


def still_driven(recording: Recording, start: int, stop: int) -> float:
    """Return the time after a stop in which measured joints are faster than 2 % of the motion's speed [s]."""
    past = int(np.searchsorted(recording.time, recording.time[stop] + DRIVEN + PAUSE))
    rows = slice(start, past)
    known = "actual_q" in recording and np.isfinite(recording["actual_q"][rows]).all()
    if not known or past - start < FEWEST:
        return 0.0
    time = recording.time[rows]
    q = low_pass_at(time, recording["actual_q"][rows], recording.period, SMOOTHED)
    speed = np.max(np.abs(np.gradient(q, time, axis=0)), axis=1)
    fast = time[speed > SWUNG * np.max(speed)] - recording.time[stop]
    return float(np.max(fast[fast <= DRIVEN], initial=0.0))


def _onwards(q: Floats, velocity: Floats, first: int, last: int) -> Floats:
    """Return the speed towards a motion's end [rad/s], negative while swinging back; to and fro, its magnitude."""
    joint = int(np.argmax(np.abs(q[last] - q[first])))
    way, travelled = q[last, joint] - q[first, joint], np.sum(np.abs(np.diff(q[first : last + 1, joint])))
    rates = velocity[first : last + 1]
    return np.asarray(
        rates[:, joint] * np.sign(way) if abs(way) > 0.9 * travelled else np.max(np.abs(rates), axis=1)
    )


def _noise_of_speed(q: Floats, period: float) -> float:
    """Return the standard deviation of the speed that is computed from resting, smoothed encoders [rad/s]."""
    second = np.diff(q, n=2, axis=0)
    noise = float(np.max(np.median(np.abs(second), axis=0))) / (0.6745 * math.sqrt(6.0))
    cut_off = min(SMOOTHED, 0.45 / period)
    return noise * 2.0 * math.pi * cut_off * math.sqrt(2.0 * cut_off * period / 3.0)


def _taper(time: Floats, speed: Floats, row: int, inwards: int) -> float:
    """Return the time in which a speed that grows with the square of time reaches its value in a row [s]."""
    other = row + 3 * inwards
    if not 0 <= other < len(time):
        return 0.0
    slope = abs(float(speed[other] - speed[row]) / float(time[other] - time[row]))
    return min(2.0 * float(speed[row]) / slope, TAPER) if slope > 0.0 else 0.0

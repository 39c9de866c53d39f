"""Find motions in measured joint angles, and the lag of an arm behind its target."""

import math

import numpy as np
from scipy.ndimage import maximum_filter1d

from tvist_lab.metrics.vibration import SENSOR, low_pass_at
from tvist_lab.recordings import Floats, Recording

SMOOTHED = 20.0  # cut-off frequency of the angles before they are differentiated [Hz]
REST_SPEED = 0.01  # speed above which a joint certainly moves [rad/s]
FAST = 2.0  # largest speed of a motion must exceed the speed at its ends by this factor [-]
SWING = 0.5  # time around a fast motion in which the arm may swing back from an overshoot [s]
SWUNG = 0.02  # largest speed of swinging back, relative to the largest speed within that time [-]
DRIVEN = 0.15  # longest time after a stop in which joints may still be driven [s]
PAUSE = 0.1  # rests shorter than this belong to a motion, as at a reversal or while the arm vibrates [s]
SMALLEST = 0.005  # smallest displacement of a motion [rad]; less is vibration
FEWEST = 16  # smallest number of rows in which motions are sought
TAPER = 0.03  # longest time for which a joint may have moved below `REST_SPEED` before and after [s]
LONGEST_LAG = 0.2  # longest lag in the search [s]
FOLLOWS = 0.05  # largest variance of an arm's distance to its delayed target, over the target's [-]
LONGEST_FELT = 0.08  # longest lag in the search with the accelerometer [s]
FINE = 0.002  # longest step of the search with the accelerometer [s]
SMOOTHED_TARGET = 40.0  # cut-off frequency of the target before it is differentiated twice [Hz]
EXPLAINED = 0.5  # largest share of the accelerometer signal that may remain unexplained [-]
FEWEST_SEEN = 8


def measured_spans(recording: Recording, name: str = "actual_q") -> list[tuple[int, int]]:
    """Return first and last row of each motion, in order, from joint angles that are noisy even at rest.

    A joint moves while its speed exceeds 0.01 rad/s, six times the encoders' noise, and 2 % of the fastest
    speed within half a second, which excludes swinging back. Each motion must reach twice this threshold.
    Both ends are then shifted outwards by the time in which a speed that grows steadily reaches the
    threshold, at most 30 ms.
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
    """Return the speed towards a motion's end [rad/s], negative if swinging back, |speed| if to and fro."""
    joint = int(np.argmax(np.abs(q[last] - q[first])))
    way, travelled = q[last, joint] - q[first, joint], np.sum(np.abs(np.diff(q[first : last + 1, joint])))
    rates = velocity[first : last + 1]
    return np.asarray(
        rates[:, joint] * np.sign(way) if abs(way) > 0.9 * travelled else np.max(np.abs(rates), axis=1)
    )


def _noise_of_speed(q: Floats, period: float) -> float:
    """Return the standard deviation of the speed that is computed from smoothed encoders at rest [rad/s]."""
    second = np.diff(q, n=2, axis=0)
    noise = float(np.max(np.median(np.abs(second), axis=0))) / (0.6745 * math.sqrt(6.0))
    cut_off = min(SMOOTHED, 0.45 / period)
    return noise * 2.0 * math.pi * cut_off * math.sqrt(2.0 * cut_off * period / 3.0)


def _taper(time: Floats, speed: Floats, row: int, inwards: int) -> float:
    """Return the time in which the speed has reached its value in a row, if it grew as time squared [s]."""
    other = row + 3 * inwards
    if not 0 <= other < len(time):
        return 0.0
    slope = abs(float(speed[other] - speed[row]) / float(time[other] - time[row]))
    return min(2.0 * float(speed[row]) / slope, TAPER) if slope > 0.0 else 0.0


def servo_lag(recording: Recording, start: int, stop: int) -> float | None:
    """Return the lag of `actual_q` behind `target_q` in a motion [s], ≥ 0; None if the arm does not follow.

    The lag is the shift, to a tenth of a sample, of the target from row `start` to `stop` that has the least
    squared distance to the measured angles. Without these, its accelerations best explain the tool's.
    """
    if "target_q" not in recording:
        return None
    if "actual_q" not in recording:
        return _felt_lag(recording, start, stop)
    time, period = recording.time, recording.period
    past = int(np.searchsorted(time, time[stop] + LONGEST_LAG))
    rows = slice(start, min(past + 1, len(time)))
    target, actual, own = recording["target_q"][rows], recording["actual_q"][rows], time[rows]
    joint = int(np.argmax(np.ptp(target, axis=0)))
    moved, followed = target[:, joint], actual[:, joint]
    seen = np.isfinite(moved) & np.isfinite(followed)
    if np.count_nonzero(seen) < FEWEST_SEEN:
        return None
    own, moved, followed = own[seen], moved[seen], followed[seen]
    lags = np.arange(0.0, LONGEST_LAG, period)
    distance = np.array([_distance(own, moved, followed, lag) for lag in lags])
    best = int(np.argmin(distance))
    if distance[best] > FOLLOWS * float(np.var(moved)):
        return None
    if best == 0:
        return 0.0
    fine = lags[best] + period * np.linspace(-1.0, 1.0, 21)
    return float(min(fine, key=lambda lag: _distance(own, moved, followed, lag)))


def _felt_lag(recording: Recording, start: int, stop: int) -> float | None:
    """Return the lag at which the target best explains the tool accelerometer [s]; None if it hardly does."""
    if SENSOR not in recording:
        return None
    time, period = recording.time, recording.period
    past = min(int(np.searchsorted(time, time[stop] + LONGEST_LAG)) + 1, len(time))
    shown = start + np.flatnonzero(np.isfinite(recording[SENSOR][start:past]).all(axis=1))
    target = recording["target_q"][start:past]
    if len(shown) < 4 * FEWEST_SEEN or not np.isfinite(target).all():
        return None
    own = time[start:past]
    moved = low_pass_at(own, target[:, np.ptp(target, axis=0) > 1e-3], period, SMOOTHED_TARGET)
    velocity = np.gradient(moved, own, axis=0)
    acceleration = np.gradient(velocity, own, axis=0)
    felt = recording[SENSOR][shown]
    # Polynomials in time stand for gravity, whose direction in the tool's frame changes slowly.
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

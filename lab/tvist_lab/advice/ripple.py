"""Vibration excited by an arm's gears, which no shaper of the reference removes.

A strain wave gear has a kinematic error with two waves per turn of its motor. While the arm brakes, their frequency
falls through that of each mode. The vibration they excite depends on the path of the joints in time: it is fitted to a
recorded stop and computed anew for the shaped motion; only the rest of the vibration is shaped.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from tvist_lab.metrics.ring_down import decay_rate
from tvist_lab.recordings import Floats

WAVES = 202.0  # waves of the error per turn of a joint [-], for a gear ratio of 101, as in most UR joints
WINDOW = (-0.6, 0.5)  # time around the stop in which the waves are fitted [s]
BRAKING = 0.5  # weight of samples before the stop, when the drives accelerate the arm [-]
ERROR = 2e-5  # displacement of the tool by which gear errors may move it: 2e-5 rad at one metre [m]
ALIKE = 15.0  # factor by which neighbouring samples of a residual count less [-]
PHASES = (np.sin, np.cos)
TURNS = 0.05  # smallest travel of a joint that counts [rad]

Poles = tuple[complex, ...]  # pole of each mode [1/s]


class Ripple(NamedTuple):
    """The gears' part of the vibration around a stop."""

    poles: Poles
    weights: Floats  # shape (columns of `_excited`, 3)

    def along(self, q: Floats, ends: Floats, period: float) -> Floats:
        """Return the acceleration that the gears excite along a path of the joints [m/s²].

        `q` [rad] has shape (T, n); `ends`, shape (2, n), are the smallest and largest angles of the recorded path.
        """
        return np.asarray(np.column_stack(list(_excited(q, ends, self.poles, period))) @ self.weights)


def poles_of(modes: Sequence[tuple[float, float]]) -> Poles:
    """Return the poles of modes given by f_d [Hz] and ζ [-]."""
    return tuple(complex(-decay_rate(f_d, zeta), 2.0 * np.pi * f_d) for f_d, zeta in modes)


def fitted(time: Floats, alpha: Floats, q: Floats, poles: Poles) -> Ripple | None:
    """Fit the vibration excited by gears in a recorded stop, together with that excited by the reference.

    `time` after the stop [s], evenly spaced, has shape (T,), `alpha` [m/s²] (T, 3), `q` [rad] (T, n). None if
    no mode or no turning joint is known.
    """
    period, ends = float(time[1] - time[0]), np.array([q.min(axis=0), q.max(axis=0)])
    gears = list(_excited(q, ends, poles, period))
    if not gears:
        return None
    counts = (time > WINDOW[0]) & (time < WINDOW[1])
    weight = np.where(time[counts] < 0.0, BRAKING, 1.0)[:, None]
    slow = np.where((time <= 0.0)[:, None], np.vander(time, 4), 0.0)
    others = weight * np.column_stack([*_driven(q, poles, period), slow])[counts]
    others, _ = np.linalg.qr(others / (np.sqrt(np.mean(others**2, axis=0)) + 1e-12))
    left, waves = weight * alpha[counts], weight * np.column_stack(gears)[counts]
    left, waves = (one - others @ (others.T @ one) for one in (left, waves))
    mode = np.resize(np.repeat(np.arange(len(poles)), len(PHASES) * 2), len(gears))
    ways = _directions(time, alpha, poles)[mode]
    # Without a prior, the waves would absorb errors of the other terms.
    prior = np.diag(ALIKE * np.sqrt(np.mean(left**2)) / (ERROR * np.abs(np.array(poles)[mode]) ** 2))
    columns = np.vstack([*(waves * axis for axis in ways.T), prior])
    weights = np.linalg.lstsq(columns, np.append(left.T.ravel(), np.zeros(len(gears))))[0]
    return Ripple(poles, weights[:, None] * ways)


def _directions(time: Floats, alpha: Floats, poles: Poles) -> Floats:
    """Return the direction in which the tool swings in each mode, shape (modes, 3)."""
    late = (time > 0.0) & (time < WINDOW[1])
    waves = [
        part for pole in poles for wave in [np.exp(pole * time[late])] for part in (wave.real, wave.imag)
    ]
    found = np.linalg.lstsq(np.column_stack(waves), alpha[late])[0].reshape(-1, 2, 3)
    return np.asarray(np.linalg.svd(found)[2][:, 0])


def _excited(q: Floats, ends: Floats, poles: Poles, period: float) -> Iterator[Floats]:
    """Yield the response of each mode to the waves of each joint that turns, in both phases."""
    for joint in np.flatnonzero(ends[1] - ends[0] > TURNS):
        for pole in poles:
            for wave in PHASES:
                yield from _response(wave(WAVES * q[:, joint]), pole, period)


def _driven(q: Floats, poles: Poles, period: float) -> Iterator[Floats]:
    """Yield the acceleration that a rigid arm would have, and the response of each mode to it."""
    joint = int(np.argmax(np.ptp(q, axis=0)))
    speed = np.gradient(q[:, joint], period)
    acceleration = np.gradient(speed, period)
    yield from (acceleration, speed**2, speed * acceleration)
    for pole in poles:
        yield from _response(acceleration, pole, period)
        yield from _response(speed**2, pole, period)


def _response(drive: Floats, pole: complex, period: float) -> tuple[Floats, Floats]:
    response = lfilter([period], [1.0, -np.exp(pole * period)], np.gradient(drive, period).astype(complex))
    return response.real, response.imag

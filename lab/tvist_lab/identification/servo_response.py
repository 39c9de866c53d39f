"""Lag with which a robot follows set-points: q̈ = k (p - q - T q̇), plus a delay in transmission."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from tvist_lab.identification.ring_downs import fresh
from tvist_lab.recordings import Floats, Recording
from tvist_plant.plant import PERIOD

GUESS = (0.008, 0.04, 1500.0)  # delay [s], T [s] and k [1/s²] from which the search starts
LATEST = 0.2  # longest delay in the search [s]
FOLLOWS = 0.02  # largest rms error with which this model counts as valid, relative to the way [-]
MAX_DEVIATION = 0.3  # largest deviation of the logarithms of T and k with which a lag counts as known [-]


@dataclass(frozen=True)
class ServoResponse:
    """How a robot follows set-points."""

    delay: float  # time from a set-point until the measured angle responds [s]
    lag: float  # T [s]
    gain: float  # k [1/s²]
    errors: tuple[float, float]  # standard deviations of the logarithms of T and k [-]

    @property
    def poles(self) -> tuple[complex, ...]:
        """Poles with which the arm's set-point comes to rest, one of each pair [1/s]."""
        roots = np.roots([1.0, self.gain * self.lag, self.gain])
        return tuple(complex(root) for root in roots if root.imag >= 0.0)


def servo_response(moves: Sequence[Recording]) -> ServoResponse | None:
    """Fit the lag to moves of a joint that hardly bends, such as the last one; None if no such servo fits.

    In the recordings, `target_q` are the set-points.
    """
    parts = [_part(move) for move in moves]
    way = max(float(np.ptp(target)) for target, *_ in parts)

    def apart(values: Floats) -> Floats:
        delay, lag, gain = float(values[0]), float(np.exp(values[1])), float(np.exp(values[2]))
        left = []
        for target, ticks, angles in parts:
            followed = np.interp(
                ticks - delay / PERIOD, np.arange(len(target)), followed_by(target, lag, gain)
            )
            left.append(followed - angles - np.mean(followed - angles))
        return np.concatenate(left) / way

    start = np.array([GUESS[0], *np.log(GUESS[1:])])
    bounds = [0.0, math.log(0.005), math.log(20.0)], [LATEST, math.log(1.0), math.log(1e5)]
    found = least_squares(apart, start, bounds=bounds, x_scale=[0.002, 0.1, 0.1])
    left = float(np.sqrt(np.mean(found.fun**2)))
    if left > FOLLOWS:
        return None
    covariance = left**2 * np.linalg.pinv(found.jac.T @ found.jac)
    errors = np.sqrt(np.diag(covariance))[1:].tolist()
    if max(errors) > MAX_DEVIATION:
        return None
    lag, gain = np.exp(found.x[1:]).tolist()
    return ServoResponse(float(found.x[0]), lag, gain, (errors[0], errors[1]))


def followed_by(target: Floats, lag: float, gain: float) -> Floats:
    """Return the angles of a servo that follows set-points, each held for a period, shape (T,) [rad]."""
    move = expm(PERIOD * np.array([[0.0, 1.0, 0.0], [-gain, -gain * lag, gain], [0.0, 0.0, 0.0]]))
    state, found = np.array([target[0], 0.0]), np.empty(len(target))
    for tick, setpoint in enumerate(target):
        state = move[:2, :2] @ state + move[:2, 2] * setpoint
        found[tick] = state[0]
    return found


def _part(move: Recording) -> tuple[Floats, Floats, Floats]:
    """Return for the joint that moves most: set-points by tick, and ticks and angles of new measurements."""
    ticks, target = move["tick"] - move["tick"][0], move["target_q"]
    joint = int(np.argmax(np.ptp(target, axis=0)))
    seen = fresh(move)
    every = np.interp(np.arange(ticks[-1] + 1.0), ticks, target[:, joint])
    return every, ticks[seen], move["actual_q"][seen, joint]

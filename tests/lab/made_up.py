"""Logs of made-up stops that ring as a real UR5 does, whose modes are known."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from tests.lab.matrix_pencil import WINDOW, Found

from tvist_lab.recordings import Recording

RATES = (125.0, 266.0, 500.0)
"""Rates of the accelerometer [Hz]."""
JOINTS_EVERY = 0.008
"""Time between samples of the joints, which are held meanwhile [s]."""
ENCODER = 1e-5
"""Step of the encoders [rad]."""
BEFORE = 0.9
"""Time before the stop that is recorded [s]."""
MOVES = 0.7
"""Time that a motion takes [s]."""
RISE = 0.03
"""Share by which f_d rises as a mode decays [-]."""
LAG = 0.02
"""Time by which the joints come after their target [s]."""
FINE = 1e-3
"""Step of integration [s]."""


class Speed(NamedTuple):
    """How a stop is made."""

    velocity: float
    """Speed before it [rad/s]."""
    acceleration: float
    """Deceleration [rad/s²]."""
    amplitude: tuple[float, float]
    """Amplitude of the strongest mode at the stop, least and most [m/s²]."""
    overshoot: float
    """Largest overshoot of a joint [rad]."""
    rest: tuple[float, float]
    """Rest after it [s]."""


SPEEDS = {
    "slow": Speed(1.05, 1.4, (0.4, 1.2), 2e-4, (0.55, 1.5)),
    "fast": Speed(3.2, 25.0, (2.0, 5.0), 4e-3, (0.8, 2.3)),
}


@dataclass(frozen=True)
class MadeUp:
    """A log of one stop, and what is true of it."""

    recording: Recording
    stop: float
    """End of the target's motion [s]."""
    modes: tuple[Found, ...]
    """The true modes, the strongest first, with the means of f_d and ζ over the window of the other method, weighted by
    the square of the amplitude.
    """


def made_up(speed, seed):
    """Make up a log of one stop: one to four modes, 2 to 4 Hz apart and of like size.

    An oscillation of amplitude a has f_d (1 - .03 a/a_0) and the damping ratio ζ_1 + (ζ_0 - ζ_1) a/a_0, with ζ_0 of .03
    to .06 and ζ_1 of .013 to .03. A joint overshoots, swings back for .3 s, and the tool feels that as well.
    """
    random = np.random.default_rng([seed, 2013])
    period = 1.0 / float(random.choice(RATES))
    late = np.arange(-BEFORE, random.uniform(*speed.rest), period) + random.uniform(0.0, period)
    alpha, modes = _ring(random, speed, late)
    overshoot = speed.overshoot * random.uniform(0.5, 1.0) * random.choice([-1.0, 1.0])
    fine = np.arange(late[0] - 0.1, late[-1] + 0.1, FINE)
    course = _joint(speed, fine - LAG) + _overshoot(fine - LAG, overshoot)
    pull = np.convolve(np.gradient(np.gradient(course, FINE), FINE), np.full(11, 1.0 / 11.0), "same")
    alpha += np.outer(np.interp(late, fine, pull), random.uniform(0.2, 0.8) * _direction(random))
    alpha += random.uniform(0.022, 0.031) * random.standard_normal(alpha.shape)
    held = late[0] + np.floor((late - late[0]) / JOINTS_EVERY + 1e-9) * JOINTS_EVERY
    joint, axis = int(random.integers(6)), np.zeros((len(late), 6))
    actual_q, target_q, target_qd = axis.copy(), axis.copy(), axis.copy()
    actual_q[:, joint] = np.interp(held, fine, course)
    actual_q = np.round(actual_q / ENCODER) * ENCODER
    target_q[:, joint] = np.interp(held, fine, _joint(speed, fine))
    target_qd[:, joint] = np.interp(held, fine, np.gradient(_joint(speed, fine), FINE))
    rests = (held >= 0.0) | (held <= -MOVES)
    target_qd[rests], target_q[rests] = 0.0, actual_q[rests]  # as that robot does
    columns = {
        "tick": np.arange(1.0, len(late) + 1.0),
        "timestamp": BEFORE + late,
        "target_q": target_q,
        "target_qd": target_qd,
        "actual_q": actual_q,
        "actual_tool_accelerometer": alpha + 9.81 * _direction(random),
    }
    return MadeUp(Recording(columns, foreign=True), BEFORE, modes)


def _ring(random, speed, late):
    """Sum of the modes at some times after the stop, and what is true of them."""
    count = int(random.integers(1, 5))
    f_d = random.uniform(7.0, 15.0) + np.append(0.0, np.cumsum(random.uniform(2.0, 4.0, count - 1)))
    sizes = random.uniform(0.4, 1.0, count)
    sizes *= random.uniform(*speed.amplitude) / sizes.max()
    zeta_0, zeta_1 = random.uniform(0.03, 0.06, count), random.uniform(0.013, 0.03, count)
    fine = np.arange(0.0, max(late[-1], WINDOW[1]) + FINE, FINE)
    window = (fine >= WINDOW[0]) & (fine <= min(WINDOW[1], late[-1]))
    rings = late >= 0.0
    alpha, modes = np.zeros((len(late), 3)), list[Found]()
    for f, a_0, z_0, z_1 in zip(f_d, sizes, zeta_0, zeta_1, strict=True):
        a, phase = a_0, random.uniform(0.0, 2.0 * np.pi)
        course = np.empty((len(fine), 4))  # amplitude, phase, f_d, ζ
        for row in course:
            now, zeta = f * (1.0 - RISE * a / a_0), z_1 + (z_0 - z_1) * a / a_0
            row[:] = a, phase, now, zeta
            phase += 2.0 * np.pi * now * FINE
            a *= np.exp(-2.0 * np.pi * now * zeta / np.sqrt(1.0 - zeta * zeta) * FINE)
        directions = _direction(random), random.uniform(0.0, 0.3) * _direction(random)
        for turn, direction in zip((np.cos, np.sin), directions, strict=True):
            wave = np.interp(late[rings], fine, course[:, 0] * turn(course[:, 1]))
            alpha[rings] += np.outer(wave, direction)
        mean = np.average(course[window, 2:], axis=0, weights=course[window, 0] ** 2)
        modes.append(Found(float(mean[0]), float(mean[1]), float(course[window, 0][0])))
    return alpha, tuple(sorted(modes, key=lambda one: -one.amplitude))


def _joint(speed, late):
    """Angle of a joint that stops at 0 s [rad]."""
    ramp = min(speed.velocity / speed.acceleration, 0.5 * MOVES)
    rate = speed.acceleration * np.clip(np.minimum(late + MOVES, -late), 0.0, ramp)
    return np.asarray(np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(late))) - 1.0)


def _overshoot(late, tail):
    """Overshoot that is largest after .08 s and swings back within .3 s [rad]."""
    since = np.clip(late, 0.0, None) / 0.08
    return np.asarray(tail * since**2 * np.exp(2.0 * (1.0 - since)))


def _direction(random):
    axis = random.normal(size=3)
    return np.asarray(axis / np.linalg.norm(axis))

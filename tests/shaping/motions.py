"""Motions at the limits, and what an oscillator makes of them."""

from itertools import pairwise

import numpy as np
from scipy.linalg import expm

H = 0.002
VELOCITY, ACCELERATION, JERK = 1.5, 2.0, 100.0


def double_s(way, share=1.0):
    """A motion at a share of the limits, as a convolution of three boxes, and half a second of rest."""
    way = np.asarray(way, dtype=float)
    velocity, acceleration, jerk = share * VELOCITY, share**2 * ACCELERATION, share**3 * JERK
    longest = np.abs(way).max()
    velocity = min(velocity, np.sqrt(longest * acceleration))
    times = (longest / velocity, velocity / acceleration, acceleration / jerk)
    profile = np.ones(1)
    for time in times:
        ticks = int(np.ceil(time / H))
        profile = np.convolve(profile, np.full(ticks, 1.0 / ticks))
    return np.concatenate([np.cumsum(profile), np.ones(250)])[:, None] * way


def shaped_by(tvist, reference):
    return np.array([tvist.filter(q) for q in reference])


def amplitude(deflection, velocity, f_d, zeta):
    """Amplitude of a mode's free oscillation from a state."""
    omega_d = 2.0 * np.pi * f_d
    return np.hypot(deflection, velocity / omega_d + zeta / np.sqrt(1.0 - zeta**2) * deflection)


def oscillation_left(reference, f_d, zeta):
    """Amplitude of a mode's free oscillation at the end, exactly: the reference is a line between ticks."""
    omega_n = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    system = np.zeros((4, 4))  # state x, ẋ, r, ṙ
    system[0, 1] = system[2, 3] = 1.0
    system[1] = [-(omega_n**2), -2.0 * zeta * omega_n, omega_n**2, 0.0]
    tick, x = expm(system * H), np.array([reference[0], 0.0])
    for now, then in pairwise(reference):
        x = (tick @ np.array([*x, now, (then - now) / H]))[:2]
    return amplitude(x[0] - reference[-1], x[1], f_d, zeta)

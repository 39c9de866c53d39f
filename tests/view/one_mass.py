"""One mass on a spring behind a shaper, by which the same in the page for trying shaping is checked."""

from dataclasses import dataclass

import numpy as np

from tvist_shaping import shaper
from tvist_view.look import Floats

STEP = 0.002
"""Time between two samples [s]."""
TURN = 1.0
"""Angle of the motion [rad]."""
MOTION_S = 0.6
"""Duration of the motion before it is shaped [s]."""
JERK_S = 0.04
"""Time over which its acceleration rises [s]."""
LENGTH_S = 2.0
"""Duration that is computed [s]."""


@dataclass(frozen=True)
class Swing:
    """A motion and the vibration it causes; T samples."""

    time: Floats
    """Shape (T,) [s]."""
    reference: Floats
    """Angle of the joint's reference, shape (T,) [rad]."""
    deflection: Floats
    """Angle by which the spring is bent, shape (T,) [rad]."""

    @property
    def left(self):
        """Largest deflection after the reference has stopped [rad]."""
        moving = np.flatnonzero(np.abs(self.reference - self.reference[-1]) > 1e-9)
        return float(np.abs(self.deflection[moving[-1] + 1 :]).max())


def swing(f_d, zeta, believed):
    """Turn the mass by `TURN`.

    δ'' + 2 ζ ω δ' + ω² δ = -q̈, with ω = 2π f_d/√(1-ζ²), solved exactly for an acceleration that is constant between
    samples.
    """
    time = np.arange(0.0, LENGTH_S, STEP)
    acceleration = _profile(time)
    if believed is not None:
        impulses = shaper("zv").function(*believed)
        acceleration = sum(
            amplitude * _profile(time - delay)
            for amplitude, delay in zip(impulses.A, impulses.tau, strict=True)
        )
    omega = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    decay, turn = np.exp(-zeta * omega * STEP), 2.0 * np.pi * f_d * STEP
    c, s = np.cos(turn), np.sin(turn)
    w_d, sigma = 2.0 * np.pi * f_d, zeta * omega
    free = decay * np.array([[c + sigma / w_d * s, s / w_d], [-(omega**2) / w_d * s, c - sigma / w_d * s]])
    still = np.array([1.0, 0.0]) / omega**2
    forced = still - free @ still
    state, deflection = np.zeros(2), np.empty(len(time))
    for place, a in enumerate(acceleration):
        deflection[place] = state[0]
        state = free @ state - forced * a
    velocity = np.cumsum(acceleration) * STEP
    return Swing(time, np.cumsum(velocity) * STEP, deflection)


def _profile(time):
    """Acceleration of the motion: up, then down, each with finite jerk."""
    half = MOTION_S / 2.0

    def pulse(t):
        return np.asarray(np.clip(np.minimum(t, half - t) / JERK_S, 0.0, 1.0))

    shape = pulse(time) - pulse(time - half)
    return np.asarray(shape * TURN / (half * (half - JERK_S)))

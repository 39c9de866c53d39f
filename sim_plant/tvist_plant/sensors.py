"""What the arm feels: a MEMS accelerometer in the flange, encoders in its joints."""

import numpy as np

from tvist_plant.model import Floats


class Accelerometer:
    """Three-axis specific force in the flange frame with white noise.

    At rest it reads the reaction to gravity: 9.81 m/s² pointing up.

    Args:
        noise: rms per axis [m/s^2].
        seed: Seed of the noise; equal seeds give equal noise.
    """

    def __init__(self, noise: float, seed: int) -> None:
        self._noise = noise
        self._random = np.random.default_rng([seed, 1])
        self._drawn = iter(np.empty((0, 3)))

    def read(self, specific_force: Floats) -> Floats:
        """Noisy reading [m/s^2], shape (3,)."""
        if self._noise == 0.0:
            return specific_force.copy()
        sample = next(self._drawn, None)
        if sample is None:  # drawn by the block: one call of the generator costs as much as a hundred samples
            self._drawn = iter(self._noise * self._random.standard_normal((512, 3)))
            sample = next(self._drawn)
        return np.asarray(specific_force + sample)


class Encoders:
    """Angles in steps: one is told anew once it has moved by a step.

    That is hysteresis. Rounding would flicker where an angle rests between two steps.

    Args:
        step: [rad]; 0 tells everything.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._told: Floats | None = None

    def read(self, q: Floats) -> Floats:
        """Angles as they are told, shape (n,) [rad]."""
        if self._step == 0.0:
            return q
        told = q if self._told is None else np.where(np.abs(q - self._told) >= self._step, q, self._told)
        self._told = told
        return told


def gear_phases(joints: int, seed: int) -> Floats:
    """Phase of each gear's kinematic error, drawn anew with every seed, shape (joints,) [rad]."""
    return np.random.default_rng([seed, 0]).uniform(0.0, 2.0 * np.pi, joints)

"""The arm's sensors: a MEMS accelerometer in the flange, and encoders in its joints."""

import numpy as np

from tvist_plant.model import Floats


class Accelerometer:
    """Three-axis specific force in the flange frame with white noise.

    At rest it reads the reaction to gravity: 9.81 m/s² pointing up.

    Args:
        noise: Noise, rms per axis [m/s^2].
        seed: Seed of the noise; equal seeds give equal noise.
    """

    def __init__(self, noise: float, seed: int) -> None:
        self._noise = noise
        self._random = np.random.default_rng([seed, 1])
        self._drawn = iter(np.empty((0, 3)))

    def read(self, specific_force: Floats) -> Floats:
        """Return a noisy reading [m/s^2], shape (3,)."""
        if self._noise == 0.0:
            return specific_force.copy()
        sample = next(self._drawn, None)
        if sample is None:  # draw a block, since one call of the generator takes as long as a hundred samples
            self._drawn = iter(self._noise * self._random.standard_normal((512, 3)))
            sample = next(self._drawn)
        return np.asarray(specific_force + sample)


class Encoders:
    """Angles with steps: a reading is updated when the angle has moved by a step.

    This is hysteresis, since rounding would flicker if an angle rests between two steps.

    Args:
        step: Size of a step [rad]; 0 to return angles unchanged.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._told: Floats | None = None

    def read(self, q: Floats) -> Floats:
        """Return the readings of the angles, shape (n,) [rad]."""
        if self._step == 0.0:
            return q
        told = q if self._told is None else np.where(np.abs(q - self._told) >= self._step, q, self._told)
        self._told = told
        return told


def gear_phases(joints: int, seed: int) -> Floats:
    """Phase of each gear's kinematic error, random for each seed, shape (joints,) [rad]."""
    return np.random.default_rng([seed, 0]).uniform(0.0, 2.0 * np.pi, joints)

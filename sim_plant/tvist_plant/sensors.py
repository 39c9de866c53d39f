"""The arm's sensors: the noise of a MEMS accelerometer in the flange, and the phases of the gears' errors."""

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
        noisy: Floats = specific_force + sample
        return noisy


def gear_phases(joints: int, seed: int) -> Floats:
    """Phase of each gear's kinematic error, random for each seed, shape (joints,) [rad]."""
    return np.random.default_rng([seed, 0]).uniform(0.0, 2.0 * np.pi, joints)

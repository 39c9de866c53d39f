"""Accelerometer and force sensor in the flange, and random phases of gear errors."""

from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from tvist_plant.model import Floats


def _rows(draw: Callable[[], Floats]) -> Iterator[Floats]:
    """Draw noise in blocks, since each call of the generator costs as much time as a hundred samples."""
    while True:
        yield from draw()


class Accelerometer:
    """Specific force in the flange frame with white noise, rms per axis [m/s^2]; +9.81 m/s² up at rest."""

    def __init__(self, noise: float, seed: int) -> None:
        random = np.random.default_rng([seed, 1])
        self._noise = noise
        self._drawn = _rows(lambda: noise * random.standard_normal((512, 3)))

    def read(self, specific_force: Floats) -> Floats:
        """Return a noisy reading [m/s^2], shape (3,)."""
        return specific_force.copy() if self._noise == 0.0 else specific_force + next(self._drawn)

    def read_all(self, specific_forces: Floats) -> Floats:
        """Return consecutive noisy readings, shape (T, 3) [m/s^2]."""
        if self._noise == 0.0:
            return specific_forces.copy()
        drawn = islice(self._drawn, len(specific_forces))
        return np.asarray(specific_forces + np.reshape(list(drawn), (-1, 3)))


class ForceSensor:
    """Flange force [N] and torque [N m] with white noise (rms) and a constant error of at most `offset`."""

    def __init__(self, noise: tuple[float, float], offset: tuple[float, float], seed: int) -> None:
        random = np.random.default_rng([seed, 2])
        error, rms = np.repeat(offset, 3) * random.uniform(-1.0, 1.0, 6), np.repeat(noise, 3)
        self._drawn = _rows(lambda: (rms * random.standard_normal((256, 6)) + error)[::-1])

    def read(self, wrench: Floats) -> Floats:
        """Return a noisy reading, shape (6,) [N, N m]."""
        return np.asarray(wrench + next(self._drawn))


def gear_phases(joints: int, seed: int) -> Floats:
    """Return the phase of each gear's kinematic error, drawn from the seed, shape (joints,) [rad]."""
    return np.random.default_rng([seed, 0]).uniform(0.0, 2.0 * np.pi, joints)

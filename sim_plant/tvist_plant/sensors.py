"""The arm's sensors, an accelerometer and a force sensor in the flange, and the phases of the gears' errors."""

import numpy as np

from tvist_plant.model import Floats


class Accelerometer:
    """Three-axis specific force in the flange frame with white noise, rms per axis [m/s^2].

    Equal seeds give equal noise. At rest it reads the reaction to gravity: 9.81 m/s² pointing up.
    """

    def __init__(self, noise: float, seed: int) -> None:
        self._noise = noise
        self._random = np.random.default_rng([seed, 1])
        self._drawn, self._used = np.empty((0, 3)), 0

    def read(self, specific_force: Floats) -> Floats:
        """Return a noisy reading [m/s^2], shape (3,)."""
        if self._noise == 0.0:
            return specific_force.copy()
        if self._used == len(self._drawn):
            self._draw()
        noisy: Floats = specific_force + self._drawn[self._used]
        self._used += 1
        return noisy

    def read_all(self, specific_forces: Floats) -> Floats:
        """Return noisy readings one after the other, as `read` does, shape (T, 3) [m/s^2]."""
        noisy, done = specific_forces.copy(), 0
        while self._noise != 0.0 and done < len(noisy):
            if self._used == len(self._drawn):
                self._draw()
            block = self._drawn[self._used : self._used + len(noisy) - done]
            noisy[done : done + len(block)] += block
            self._used, done = self._used + len(block), done + len(block)
        return noisy

    def _draw(self) -> None:
        """Draw a block, since one call of the generator takes as long as a hundred samples."""
        self._drawn, self._used = self._noise * self._random.standard_normal((512, 3)), 0


class ForceSensor:
    """Force and torque in the flange with white noise and a constant error; equal seeds give equal readings.

    The noise is the rms of force [N] and torque [N m], the offset the largest constant error of each.
    """

    def __init__(self, noise: tuple[float, float], offset: tuple[float, float], seed: int) -> None:
        self._random = np.random.default_rng([seed, 2])
        self._offset = np.repeat(offset, 3) * self._random.uniform(-1.0, 1.0, 6)
        self._noise = np.repeat(noise, 3)
        self._drawn: list[Floats] = []

    def read(self, wrench: Floats) -> Floats:
        """Return a noisy reading, shape (6,) [N, N m]."""
        if not self._drawn:  # in blocks, as above
            self._drawn = list(self._noise * self._random.standard_normal((256, 6)) + self._offset)
        return np.asarray(wrench + self._drawn.pop())


def gear_phases(joints: int, seed: int) -> Floats:
    """Phase of each gear's kinematic error, random for each seed, shape (joints,) [rad]."""
    return np.random.default_rng([seed, 0]).uniform(0.0, 2.0 * np.pi, joints)

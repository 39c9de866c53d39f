"""How the tool answers a correction: the twin's answer, and what the real arm's differs by, learnt from repetitions.

While the arm comes to rest its pose hardly changes, so it answers each bump of a joint alike, only later: of all ten
bumps of a joint, one unknown response says how the arm differs from its twin. That is why few repetitions suffice, and
why a twin whose phase is wrong, as that of an arm whose springs are a third softer, does not mislead for long. With y
what the accelerometer says, c the heights of the bumps, G the twin's answers and S the delay of a bump,

    y = y₀ + Σ_jk c_jk (G_jk + S_k δ_j) + noise

is linear in the unknown y₀ and δ_j. A Kalman filter follows them, from a guess: δ_j is as large as a share of the
twin's response, smooth, and decays. The next correction minimizes the expected square of what is left after the stop;
being an expectation over all arms that are still possible, it is cautious where little is known (Åström and Wittenmark,
Adaptive Control, 1995, section 7.3).
"""

import numpy as np

from tvist_controller.line.correction import BUMPS, JOINTS, LENGTH, STEP, bounded
from tvist_controller.line.differentiator import Floats
from tvist_plant.plant import PERIOD

THIN = 5
"""Ticks that are averaged to a sample of the accelerometer."""
LATE = 20
"""Ticks from the stop to the correction's end; ending at the stop would leave it less power over the last jerk."""
LISTENED = 120
"""Ticks after the stop in which the tool should be still."""
BEFORE = (LENGTH - LATE) // THIN
"""Number of samples before the stop."""
SAMPLES = BEFORE + LISTENED // THIN
"""Number of samples in all."""
NOISE = 0.03
"""Deviation of the accelerometer's noise in a tick [m/s²]."""
SHARE = 1.0
"""Deviation of the arm's response from the twin's, relative to the largest of that [-]."""
SMOOTH, DECAY, STEADY = 0.012, 0.08, 0.05
"""Times in which the deviation changes, in which it decays, and for which it does not decay yet [s]."""
DRIFT = 0.02
"""Share of what is guessed at first that is uncertain again after each repetition [-]."""
EFFORT = 0.15
"""Residual that a bump of 1 rad/s² has to be worth [m/s²]."""
ANY = 5.0
"""Deviation of the accelerometer's readings before anything is known [m/s²]."""


def thinned(accelerometer: Floats, begins: int) -> Floats:
    """Return the samples of a motion, shape (48, 3) [m/s²].

    Args:
        accelerometer: Specific force in each tick, shape (T, 3) [m/s²].
        begins: Number of ticks before the correction.
    """
    window = accelerometer[begins : begins + SAMPLES * THIN]
    return np.asarray(window.reshape(SAMPLES, THIN, 3).mean(axis=1))


class BumpResponses:
    """The tool's answers to bumps in one motion, as far as they are known.

    Args:
        twin: The twin's answers, shape (10, 3, 48, 3) [m/s² per rad/s²].
    """

    def __init__(self, twin: Floats) -> None:
        self._twin = twin
        time = np.arange(SAMPLES) * THIN * PERIOD
        alike = np.exp(-0.5 * ((time[:, np.newaxis] - time) / SMOOTH) ** 2)
        fading = np.exp(-np.maximum(time - STEADY, 0.0) / DECAY)
        size = SAMPLES * (1 + JOINTS)
        self._covariance, self._drift = np.zeros((2, size, size))
        for joint in range(JOINTS):
            largest = np.sqrt((twin[0, joint] ** 2).sum(axis=1)).max() / np.sqrt(3.0)
            part = self._of(joint)
            guess = (SHARE * largest) ** 2 * alike * np.outer(fading, fading)
            self._covariance[part, part] = guess + 1e-9 * np.eye(SAMPLES)
            self._drift[part, part] = DRIFT * guess
        self._covariance[:SAMPLES, :SAMPLES] = ANY**2 * np.eye(SAMPLES)
        self._mean = np.zeros((size, 3))
        self._shifts = np.array([np.eye(SAMPLES, k=-(STEP // THIN) * bump) for bump in range(BUMPS)])
        centred = np.zeros((SAMPLES, SAMPLES))
        centred[BEFORE:, BEFORE:] = np.eye(SAMPLES - BEFORE) - 1.0 / (SAMPLES - BEFORE)
        self._counts = centred  # it is its own square

    @staticmethod
    def _of(joint: int) -> slice:
        return slice(SAMPLES * (1 + joint), SAMPLES * (2 + joint))

    def hear(self, bumps: Floats, said: Floats) -> None:
        """Take a repetition.

        Args:
            bumps: Its correction, shape (10, 3) [rad/s²].
            said: What the accelerometer said, see `thinned`.
        """
        heard = np.zeros((SAMPLES, len(self._mean)))
        heard[:, :SAMPLES] = np.eye(SAMPLES)
        for joint in range(JOINTS):
            heard[:, self._of(joint)] = np.tensordot(bumps[:, joint], self._shifts, 1)
        error = said - np.tensordot(bumps, self._twin, 2) - heard @ self._mean
        self._covariance += self._drift
        shared = heard @ self._covariance
        gain = np.linalg.solve(shared @ heard.T + NOISE**2 / THIN * np.eye(SAMPLES), shared).T
        self._mean += gain @ error
        self._covariance -= gain @ shared
        self._covariance = 0.5 * (self._covariance + self._covariance.T)

    def best(self) -> Floats:
        """Return the correction with which the least is expected to be left, within its bounds, shape (10, 3)."""
        numbers = BUMPS * JOINTS
        answers = self._twin.copy()
        maps = np.zeros((BUMPS, JOINTS, SAMPLES, len(self._mean)))
        for joint in range(JOINTS):
            answers[:, joint] += self._shifts @ self._mean[self._of(joint)]
            maps[:, joint, :, self._of(joint)] = self._shifts
        flat, counted = answers.reshape(numbers, -1), maps.reshape(numbers * SAMPLES, -1)
        felt = (self._counts @ answers).reshape(numbers, -1)
        left = (self._counts @ self._mean[:SAMPLES]).reshape(-1)
        spread = (counted @ self._covariance).reshape(numbers, -1)
        weighed = (self._counts @ maps).reshape(numbers, -1)
        doubt = spread @ weighed.T
        with_left = weighed.reshape(numbers, SAMPLES, -1) * self._covariance[:SAMPLES]
        normal = felt @ flat.T + 3.0 * doubt + EFFORT**2 * np.eye(numbers)
        wanted = flat @ left + 3.0 * with_left.sum(axis=(1, 2))
        return bounded(-np.linalg.solve(normal, wanted).reshape(BUMPS, JOINTS))

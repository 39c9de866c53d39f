"""The last second of the arm: its measured postures, and how long its target has been at rest."""

from collections import deque

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

HISTORY = 1000
"""Number of past postures that are kept: two seconds."""
STEADY = 250
"""Ticks for which the target must be at rest before the arm counts as steady: 500 ms, as on UR's robots."""


class Steadiness:
    """Keeps these tick by tick."""

    def __init__(self) -> None:
        self._postures = deque[Floats](maxlen=HISTORY)
        self._still = 0

    def note(self, q: Floats, *, at_rest: bool) -> None:
        """Take the measured posture [rad] of a tick, and whether the target is at rest."""
        self._postures.append(q)
        self._still = self._still + 1 if at_rest else 0

    def forget(self) -> None:
        """Begin anew, since the arm was placed elsewhere."""
        self._postures.clear()
        self._still = 0

    @property
    def steady(self) -> bool:
        """Whether the target has been at rest for half a second."""
        return self._still >= STEADY

    @property
    def known(self) -> int:
        """Number of postures that are known, the present one included."""
        return len(self._postures)

    def past(self, steps: int) -> list[float]:
        """Measured posture a number of ticks ago, fewer than `known` [rad]."""
        return list(self._postures[-1 - steps].tolist())

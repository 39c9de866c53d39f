"""Velocity and acceleration of the shaped reference."""

import numpy as np
import numpy.typing as npt
from msgspec import Struct

Floats = npt.NDArray[np.float64]


class Target(Struct, frozen=True, eq=False, gc=False):
    """Shaped reference with its derivatives, all of one tick."""

    q: Floats
    """q*, shape (n,) [rad]."""
    qd: Floats
    """q̇*, shape (n,) [rad/s]."""
    qdd: Floats
    """q̈*, shape (n,) [rad/s^2]."""


class Differentiator:
    """Central differences: q̇ᵢ = (qᵢ₊₁ - qᵢ₋₁)/2h and q̈ᵢ = (qᵢ₊₁ - 2qᵢ + qᵢ₋₁)/h².

    All three refer to the same tick without a phase shift between them, which costs one tick of delay.

    Args:
        q: Position at rest to start from, shape (n,) [rad].
        period: Tick h [s].
    """

    def __init__(self, q: Floats, period: float) -> None:
        self._period = period
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Start anew at rest."""
        self._before = self._middle = self._last = np.array(q, dtype=float)

    def update(self, q: Floats) -> Target:
        """Take the reference of this tick; target of the tick before."""
        h = self._period
        self._before, self._middle, self._last = self._middle, self._last, q
        # Differences of neighbours first: their rounding does not grow with the position.
        rise, fall = self._last - self._middle, self._middle - self._before
        return Target(q=self._middle, qd=(rise + fall) / (2.0 * h), qdd=(rise - fall) / (h * h))

    @property
    def newest(self) -> Target:
        """State of motion at the newest reference, from it and the two before.

        A motion continued from these derivatives has the second difference q̈ at its first tick.
        """
        h = self._period
        rise, fall = self._last - self._middle, self._middle - self._before
        qdd = (rise - fall) / (h * h)
        return Target(q=self._last, qd=rise / h + 0.5 * h * qdd, qdd=qdd)

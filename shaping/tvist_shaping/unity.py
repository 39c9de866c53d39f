"""Unity-magnitude shapers: impulses +1, -1, +1, …, shorter than any positive train.

A positive train is a mean of the reference's past and keeps its limits of velocity and acceleration; +1 -1 +1 may
exceed them up to three times, and five impulses up to five times. These shapers also excite modes that are faster than
the one they are designed for. Only the times of the impulses can be chosen (Singhose, Singer and Seering, "Time-optimal
negative input shapers", J. Dyn. Sys. Meas. Control 119, 1997); here Newton's method finds them. As ζ increases, the
first times grow and pairs of impulses approach each other; the shapers end at ζ = 0.5, where the last pair is a
twentieth of a period apart.
"""

import math

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.newton import solve
from tvist_shaping.tabulated import Tabulated

ZETA_MAX = 0.5  # highest damping ratio [-]


class UnityShaper(Tabulated):
    """The equations E(1) = 0, and with `derivative` E'(1) = 0, where E(r) = Σ ±exp(r s τ_j), T_d = 1 (see `exact`)."""

    def __init__(self, positive: str, duration_periods: float, *, derivative: bool) -> None:
        """Set up three impulses, or five with `derivative`; `positive` is the shaper for higher damping ratios."""
        self.derivative = derivative
        self.A = np.array([1.0, -1.0, 1.0, -1.0, 1.0] if derivative else [1.0, -1.0, 1.0])
        # Without damping; for five impulses, four digits are enough as a starting point.
        start = np.array([0.0895, 0.3662, 0.643, 0.7325] if derivative else [1 / 6, 1 / 3])
        super().__init__(start, ZETA_MAX, f"take {positive}", duration_periods)

    def follow(self, zeta: float, near: Floats) -> tuple[Floats, Floats, Floats]:
        """Solve at ζ; see `Tabulated.follow`."""
        s = 2.0 * math.pi * (zeta / math.sqrt(1.0 - zeta * zeta) + 1j)

        def equations(points: Floats) -> Floats:
            tau = np.hstack([np.zeros((len(points), 1)), points])
            waves = self.A * np.exp(s * (tau - tau[:, -1:]))
            sums = [waves.sum(axis=1)]
            if self.derivative:
                sums.append((waves * tau).sum(axis=1))
            return np.stack([part for value in sums for part in (value.real, value.imag)], axis=1)

        x = solve(equations, near)
        return x, self.A, np.concatenate([[0.0], x])


um_zv = UnityShaper("zv", 0.353461707, derivative=False)
"""Unity-magnitude zero-vibration shaper: up to 3 times the acceleration, for ζ < 0.5.

A = (1, -1, 1) [-]; without damping τ = (0, 1/6, 1/3)/f_d [s].
"""
um_zvd = UnityShaper("zvd", 0.790878917, derivative=True)
"""Unity-magnitude zero-vibration-and-derivative shaper: up to 5 times the acceleration, for ζ < 0.5.

A = (1, -1, 1, -1, 1) [-]; without damping τ = (0, 0.0895, 0.3662, 0.6430, 0.7325)/f_d [s].
"""

"""One flexible joint whose inertia depends on the configuration: its mode in closed form.

As in the paper's Figure 2, an actuator with flexibility carries an arm that stretches and folds. With a motor that
holds its reference q*, and a spring K and a damper D in parallel, the link's angle θ obeys

    I θ̈ + D (θ̇ - q̇*) + K (θ - q*) = 0

while the arm behind the joint keeps its shape. This is a mode with (any textbook on vibrations; eq. (5))

    ω_n = √(K/I),    ζ = D / (2 √(K I)),    f_d = ω_n/(2π) √(1 - ζ²)
"""

import math
from collections.abc import Callable

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError, check_positive
from tvist_shaping.estimators.base import Estimator


def flexible_joint(inertia: float, stiffness: float, damping: float) -> tuple[float, float]:
    """Return f_d [Hz] and ζ [-] of a flexible joint that carries an inertia: ω_n = √(K/I), ζ = D/(2√(K I)) and eq. (5).

    Args:
        inertia: I about the joint's axis [kg m²], > 0.
        stiffness: K of its spring [N m/rad], > 0.
        damping: D of the damper parallel to the spring [N m s/rad], >= 0.

    Raises:
        EstimatorError: A value is out of range, or the damping is so large that nothing vibrates.
    """
    check_positive(EstimatorError, inertia=inertia, stiffness=stiffness)
    critical = 2.0 * math.sqrt(stiffness * inertia)
    if not 0.0 <= damping < critical:
        raise EstimatorError(
            "damping", damping, f"at least 0 and less than 2 √(K I) = {critical:g} N m s/rad"
        )
    zeta = damping / critical
    return math.sqrt(stiffness / inertia) * math.sqrt(1.0 - zeta**2) / (2.0 * math.pi), zeta


class FlexibleJoint(Estimator):
    """Estimator of one flexible joint: f_d(q) and ζ(q) from the inertia I(q) that it carries.

    Args:
        inertia: Function from joint angles, shape (joints,) [rad], to I about the joint's axis [kg m²].
        inertia_range: Smallest and largest inertia [kg m²]; others are clamped to it, and set `clipped`.
        stiffness: K of the joint's spring [N m/rad].
        damping: D of the damper parallel to the spring [N m s/rad].

    Raises:
        EstimatorError: A value is out of range.
    """

    def __init__(
        self,
        inertia: Callable[[Floats], float],
        inertia_range: tuple[float, float],
        stiffness: float,
        damping: float,
    ) -> None:
        low, high = inertia_range
        if not low <= high:
            raise EstimatorError("inertia_range", inertia_range, "the smaller value and then the larger one")
        self._inertia, self._low, self._high = inertia, float(low), float(high)
        self._stiffness, self._damping = float(stiffness), float(damping)
        ends = [flexible_joint(end, self._stiffness, self._damping) for end in (self._low, self._high)]
        # Between the ends, f_d² = (K/I - D²/4I²)/4π² has no minimum, and ζ decreases with the inertia.
        self.modes, self.f_d_min, self.zeta_max = 1, min(f_d for f_d, _ in ends), ends[0][1]

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Mode at a configuration; see `Estimator.estimate`."""
        inertia = float(self._inertia(q))
        held = min(max(inertia, self._low), self._high)
        self.clipped = held != inertia
        f_d, zeta = flexible_joint(held, self._stiffness, self._damping)
        return np.array([f_d]), np.array([zeta])

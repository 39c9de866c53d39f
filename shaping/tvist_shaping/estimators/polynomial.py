"""The paper's estimator: two multivariate trigonometric polynomials f_d(q) and ζ(q), sec. 3.3."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.basis import BasisFunctions
from tvist_shaping.impulse_train import F_D_RANGE

MARGIN = 0.1  # share of a range, at each end, in which the saturation is curved [-]


@compiled
def saturate(x: float, low: float, high: float) -> float:
    """Clamp x to [low, high] with three continuous derivatives.

        y = low + w r((x - low)/w)        near low, w = MARGIN (high - low), and mirrored near high
        r(t) = 2 (p⁶ - 3p⁵ + 5/2 p⁴),     p = (t + 1)/2,    -1 < t < 1

    r is the integral of the quintic smooth step: r(t) = 0 below -1, t above 1. So y is x itself between low + w and
    high - w, and it is the bound itself at more than w outside the range. In between, its slope changes smoothly from
    1 to 0: a kink in f_d(q) would be a jump in the velocity of the delay, and of the arm.
    """
    w = MARGIN * (high - low)
    if x < low + w:
        p = max(0.5 * ((x - low) / w + 1.0), 0.0)
        return low + w * (((2.0 * p - 6.0) * p + 5.0) * p * p * p * p)
    if x > high - w:
        p = max(0.5 * ((high - x) / w + 1.0), 0.0)
        return high - w * (((2.0 * p - 6.0) * p + 5.0) * p * p * p * p)
    return x


@compiled
def evaluate(
    q: Floats,
    joints: npt.NDArray[np.int64],
    centre: Floats,
    multiples: npt.NDArray[np.int64],
    coefficients: Floats,
    ranges: Floats,
    modes: Floats,
) -> bool:
    """Evaluate f_d [Hz] and ζ [-] at q into `modes`, shape (2, 1); return whether one was clamped."""
    f_d = coefficients[0, 0]
    zeta = coefficients[1, 0]
    term = 1
    for row in range(multiples.shape[0]):
        phase = 0.0
        for k in range(joints.shape[0]):
            phase += multiples[row, k] * (q[joints[k]] - centre[k])
        c = math.cos(phase)
        s = math.sin(phase)
        f_d += coefficients[0, term] * c + coefficients[0, term + 1] * s
        zeta += coefficients[1, term] * c + coefficients[1, term + 1] * s
        term += 2
    inside = ranges[0, 0] <= f_d <= ranges[0, 1] and ranges[1, 0] <= zeta <= ranges[1, 1]
    modes[0, 0] = saturate(f_d, ranges[0, 0], ranges[0, 1])
    modes[1, 0] = saturate(zeta, ranges[1, 0], ranges[1, 1])
    return not inside


class Coefficients(NamedTuple):
    """Arguments of `evaluate` between the configuration and the result."""

    joints: npt.NDArray[np.int64]
    centre: Floats
    multiples: npt.NDArray[np.int64]
    coefficients: Floats
    ranges: Floats


class Polynomial(Estimator):
    """One mode, whose f_d and ζ are polynomials in the joint angles, clamped to the range of the measurements.

    f_d(q) = saturate(Σ_i a_i φ_i(q)), ζ(q) = saturate(Σ_i b_i φ_i(q)), with the φ_i of `basis.py`.

    Attributes:
        basis: The functions φ_i.
        saturating: Whether the last estimate's f_d or ζ was outside its range before it was clamped.
    """

    def __init__(
        self,
        *,
        joints: Sequence[int],
        degree: int,
        f_d_coefficients: npt.ArrayLike,
        zeta_coefficients: npt.ArrayLike,
        f_d_range: tuple[float, float],
        zeta_range: tuple[float, float],
        centre: npt.ArrayLike | None = None,
    ) -> None:
        """Create the estimator from its coefficients.

        Args:
            joints: Indices of the selected joints, from 0.
            degree: Highest total degree.
            f_d_coefficients: a [Hz], shape (terms,), in the order of `terms`.
            zeta_coefficients: b [-], shape (terms,).
            f_d_range: Lowest and highest result for f_d [Hz], 1e-6 to 1e6.
            zeta_range: Lowest and highest result for ζ [-], 0 <= ζ < 1.
            centre: Angles that are subtracted [rad], shape (len(joints),); None for zeros.

        Raises:
            EstimatorError: A parameter is invalid; the error names it.
        """
        self.basis = BasisFunctions(tuple(joints), degree, centre)
        self.saturating = False
        f_d_row = self._row("f_d_coefficients", f_d_coefficients)
        zeta_row = self._row("zeta_coefficients", zeta_coefficients)
        f_low, f_high = self._range("f_d_range", f_d_range)
        z_low, z_high = self._range("zeta_range", zeta_range)
        if f_low < F_D_RANGE[0] or f_high > F_D_RANGE[1]:
            raise EstimatorError("f_d_range", f_d_range, f"within {F_D_RANGE[0]:g} to {F_D_RANGE[1]:g} Hz")
        if z_low < 0.0 or z_high >= 1.0:
            raise EstimatorError("zeta_range", zeta_range, "within 0 <= ζ < 1")
        self.modes, self.f_d_min, self.zeta_max = 1, f_low, z_high
        self.coefficients = Coefficients(
            np.array(self.basis.joints, dtype=np.int64),
            self.basis.centre.copy(),
            self.basis.multiples(),
            np.stack((f_d_row, zeta_row)),
            np.array([[f_low, f_high], [z_low, z_high]]),
        )
        """Arguments of `evaluate`, as writable arrays, since numba's fast path accepts only those."""
        self._joints_needed = max(self.basis.joints) + 1

    def __repr__(self) -> str:
        (f_low, f_high), (z_low, z_high) = self.coefficients.ranges.tolist()
        return (
            f"Polynomial(joints={self.basis.joints}, degree={self.basis.degree}, "
            f"{len(self.basis)} terms, f_d_range=({f_low}, {f_high}), zeta_range=({z_low}, {z_high}))"
        )

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Evaluate both polynomials at a configuration; see `Estimator.estimate`."""
        if q.shape[0] < self._joints_needed:
            raise EstimatorError("q", q.shape, f"of at least {self._joints_needed} joints")
        modes = np.empty((2, 1))
        self.saturating = evaluate(q, *self.coefficients, modes)
        return modes[0], modes[1]

    def _row(self, name: str, coefficients: npt.ArrayLike) -> Floats:
        row = np.array(coefficients, dtype=float)
        if row.shape != (len(self.basis),) or not np.isfinite(row).all():
            raise EstimatorError(
                name, coefficients, f"{len(self.basis)} finite numbers, one per term of the basis"
            )
        return row

    @staticmethod
    def _range(name: str, ends: tuple[float, float]) -> tuple[float, float]:
        if len(ends) != 2 or not all(map(math.isfinite, ends)) or not ends[0] < ends[1]:
            raise EstimatorError(name, ends, "two finite numbers, the lower one first")
        return float(ends[0]), float(ends[1])

"""The paper's estimator: two multivariate trigonometric polynomials f_d(q) and ζ(q), sec. 3.3."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.impulse_train import F_D_RANGE

Integers = npt.NDArray[np.int64]

MAX_JOINTS = 7
MAX_TERMS = 1000
"""Largest number of terms; more would take too long in a tick, and ring-downs could not identify them."""
MARGIN = 0.1  # share of a range, at each end, in which the saturation is curved [-]


def basis(
    joints: Sequence[int], degree: int, centre: npt.ArrayLike | None
) -> tuple[Integers, Floats, Integers]:
    """Return joints, centre of their angles [rad] and multiples m of the functions φ_i.

    With u = q - centre of the joints, the functions are 1, and cos(m·u), sin(m·u) for integer m ≠ 0
    with Σ |m_k| <= degree; of m and -m, only the one whose first non-zero entry is positive. The
    functions are periodic in every joint, as the arm is. Their order, by degree, is that of the
    coefficients. Raise EstimatorError if an argument is invalid.
    """
    n = len(joints)
    if not 1 <= n <= MAX_JOINTS or len(set(joints)) != n or not set(joints) <= set(range(MAX_JOINTS)):
        raise EstimatorError("joints", joints, f"1 to {MAX_JOINTS} different indices below {MAX_JOINTS}")
    if degree not in range(MAX_TERMS):
        raise EstimatorError("degree", degree, "a whole number of at least 0")
    count = sum(2**i * math.comb(n, i) * math.comb(int(degree), i) for i in range(n + 1))
    if count > MAX_TERMS:
        raise EstimatorError("degree", degree, f"lower: {count} terms exceed {MAX_TERMS}")
    middle = np.zeros(n) if centre is None else np.array(centre, dtype=float)
    if middle.shape != (n,) or not np.isfinite(middle).all():
        raise EstimatorError("centre", centre, f"{n} finite angles")
    rows = [row for total in range(1, int(degree) + 1) for row in _rows(n, total)]
    rows = [row for row in rows if next(m for m in row if m) > 0]
    return np.array(joints, dtype=np.int64), middle, np.array(rows, dtype=np.int64).reshape(len(rows), n)


def _rows(n: int, total: int) -> Iterator[tuple[int, ...]]:
    """Yield the integer vectors of length n with Σ|m| = total."""
    if n == 0 and total == 0:
        yield ()
    for size in range(total, -1, -1) if n else ():
        for rest in _rows(n - 1, total - size):
            yield (size, *rest)
            if size:
                yield (-size, *rest)


def terms(
    q: npt.ArrayLike, *, joints: Sequence[int], degree: int, centre: npt.ArrayLike | None = None
) -> Floats:
    """Return the design matrix for fitting the coefficients of a `Polynomial` with these parameters [-].

    Its shape is (N, terms), in the order of the coefficients: 1, then cos and sin of each combination.

    Args:
        q: Configurations [rad], shape (N, n).
        joints: Selected joints; this and all further arguments are as in `Polynomial`.
        degree: Highest total degree.
        centre: Centre of the angles [rad], shape (len(joints),).

    Raises:
        EstimatorError: A parameter is invalid.
    """
    selected, middle, multiples = basis(joints, degree, centre)
    angles = np.asarray(q, dtype=float)
    if angles.ndim != 2 or angles.shape[1] <= max(joints):
        raise EstimatorError("q", angles.shape, f"of shape (N, n), n > {max(joints)}")
    phase = (angles[:, selected] - middle) @ multiples.T
    pairs = np.stack((np.cos(phase), np.sin(phase)), axis=2).reshape(len(phase), -1)
    return np.hstack((np.ones((len(phase), 1)), pairs))


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
    joints: Integers,
    centre: Floats,
    multiples: Integers,
    coefficients: Floats,
    ranges: Floats,
    modes: Floats,
) -> None:
    """Evaluate f_d [Hz] and ζ [-] at q into `modes`, shape (2, 1)."""
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
    modes[0, 0] = saturate(f_d, ranges[0, 0], ranges[0, 1])
    modes[1, 0] = saturate(zeta, ranges[1, 0], ranges[1, 1])


class Polynomial(Estimator):
    """One mode, whose f_d and ζ are polynomials in the joint angles, clamped to the range of the measurements.

    f_d(q) = saturate(Σ_i a_i φ_i(q)), ζ(q) = saturate(Σ_i b_i φ_i(q)), with the φ_i of `basis`.
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
        functions = basis(joints, degree, centre)
        count = 1 + 2 * len(functions[2])
        f_d_row = self._row("f_d_coefficients", f_d_coefficients, count)
        zeta_row = self._row("zeta_coefficients", zeta_coefficients, count)
        f_low, f_high = self._range("f_d_range", f_d_range)
        z_low, z_high = self._range("zeta_range", zeta_range)
        if f_low < F_D_RANGE[0] or f_high > F_D_RANGE[1]:
            raise EstimatorError("f_d_range", f_d_range, f"within {F_D_RANGE[0]:g} to {F_D_RANGE[1]:g} Hz")
        if z_low < 0.0 or z_high >= 1.0:
            raise EstimatorError("zeta_range", zeta_range, "within 0 <= ζ < 1")
        self.modes, self.f_d_min, self.zeta_max = 1, f_low, z_high
        bounds = np.array([[f_low, f_high], [z_low, z_high]])
        self.coefficients = (*functions, np.stack((f_d_row, zeta_row)), bounds)
        """Arguments of `evaluate` from `joints` to `ranges`."""
        self._joints_needed = max(joints) + 1

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Evaluate both polynomials at a configuration; see `Estimator.estimate`."""
        if q.shape[0] < self._joints_needed:
            raise EstimatorError("q", q.shape, f"of at least {self._joints_needed} joints")
        modes = np.empty((2, 1))
        evaluate(q, *self.coefficients, modes)
        return modes[0], modes[1]

    @staticmethod
    def _row(name: str, coefficients: npt.ArrayLike, count: int) -> Floats:
        row = np.array(coefficients, dtype=float)
        if row.shape != (count,) or not np.isfinite(row).all():
            raise EstimatorError(name, coefficients, f"{count} finite numbers, one per term of the basis")
        return row

    @staticmethod
    def _range(name: str, ends: tuple[float, float]) -> tuple[float, float]:
        if len(ends) != 2 or not all(map(math.isfinite, ends)) or not ends[0] < ends[1]:
            raise EstimatorError(name, ends, "two finite numbers, the lower one first")
        return float(ends[0]), float(ends[1])

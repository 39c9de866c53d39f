"""Residual vibration of a shaper when the mode differs from its design."""

import math

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.errors import ShaperRangeError, ShapingError
from tvist_shaping.impulse_train import Impulses


def residual(f: npt.ArrayLike, zeta: float, impulses: Impulses) -> Floats:
    """Return the residual vibration V [-] of a mode after the impulses, relative to that after a single impulse.

        V = exp(-ζ ω_n τ_N) √(C² + S²)
        C = Σ A_j exp(ζ ω_n τ_j) cos(ω_d τ_j),    S = Σ A_j exp(ζ ω_n τ_j) sin(ω_d τ_j)

    with ω_d = 2π f and ω_n = ω_d/√(1-ζ²) (Singer and Seering, 1990). It has the shape of f: 0 is no vibration, 1 as
    much as without shaping. Fig. 4 of the paper is V(f) at ζ = 0.

    Args:
        f: *Damped* frequency of the true mode [Hz], any shape, >= 0. (The impulses imply the design frequency.)
        zeta: Damping ratio of the true mode [-], 0 <= ζ < 1.
        impulses: Impulses of the shaper.

    Raises:
        ShaperRangeError: f or ζ is outside the range above.
    """
    frequency = np.asarray(f, dtype=float)
    if not ((frequency >= 0.0) & np.isfinite(frequency)).all():
        raise ShaperRangeError("f", float(np.min(frequency)), "finite and at least 0 Hz")
    if not 0.0 <= zeta < 1.0:
        raise ShaperRangeError("zeta", zeta, "at least 0 and less than 1")
    omega_d = 2.0 * np.pi * frequency[..., None]
    omega_n = omega_d / math.sqrt(1.0 - zeta * zeta)
    # The factor outside the sums is moved into them, since an exponent that only decays cannot overflow.
    weights = impulses.A * np.exp(zeta * omega_n * (impulses.tau - impulses.tau[-1]))
    C = (weights * np.cos(omega_d * impulses.tau)).sum(axis=-1)
    S = (weights * np.sin(omega_d * impulses.tau)).sum(axis=-1)
    return np.asarray(np.hypot(C, S))


def band(impulses: Impulses, f_d: float, zeta: float, V: float) -> tuple[float, float]:
    """Return the lowest and highest damped frequency around f_d at which the residual is at most V [Hz].

    The band is searched on a grid of f_d/1000 up to 10 f_d, and its ends are refined by bisection; a hump
    that touches V is inside. If 10 f_d is inside, the highest frequency is infinite; if f_d is outside, both
    are NaN.

    Args:
        impulses: Impulses of the shaper.
        f_d: Damped frequency to start from, usually the design frequency [Hz], > 0.
        zeta: Damping ratio of the true mode [-], 0 <= ζ < 1.
        V: Permitted residual vibration [-], 0 < V < 1.

    Raises:
        ShapingError: V or f_d is outside the range above.
        ShaperRangeError: ζ is outside the range above.
    """
    if not 0.0 < V < 1.0:
        raise ShapingError(f"V is {V!r}: must be between 0 and 1")
    if not 0.0 < f_d < math.inf:
        raise ShaperRangeError("f_d", f_d, "finite and above 0 Hz")

    limit = V + 1e-9
    if residual(f_d, zeta, impulses) > limit:
        return math.nan, math.nan
    below = f_d * np.linspace(1.0, 0.0, 1001)
    above = f_d * np.linspace(1.0, 10.0, 9001)
    return _end(below, zeta, impulses, limit), _end(above, zeta, impulses, limit)


def _end(grid: Floats, zeta: float, impulses: Impulses, limit: float) -> float:
    """Return where a residual first exceeds the limit on a grid; at the first point it is below the limit."""
    outside = np.flatnonzero(residual(grid, zeta, impulses) > limit)
    if outside.size == 0:
        return math.inf
    inner, outer = grid[outside[0] - 1], grid[outside[0]]
    for _ in range(50):
        middle = 0.5 * (inner + outer)
        if residual(middle, zeta, impulses) > limit:
            outer = middle
        else:
            inner = middle
    return float(inner)

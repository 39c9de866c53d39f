"""Impulse trains A, τ of the input shapers, as functions of a mode's damped frequency and damping ratio.

Every shaper here has equally spaced impulses with amplitudes a_j without damping, and accounts for damping by

    A_j = a_j K^j / Σ_i a_i K^i,    τ_j = j s T_d,    K = exp(-2π s ζ/√(1-ζ²)),    T_d = 1/f_d,

where K is the factor by which the mode decays in the time s T_d between two impulses. A zero of the residual vibration
at f_d remains one with any damping. The shapers that leave V instead of zero at f_d (ei, ei3) leave less than V if ζ >
0, which is safe, but their band is not the widest for their length. The shapers of `tvist_shaping.exact` leave exactly
V.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from tvist_shaping._compiled import compiled
from tvist_shaping._types import Floats
from tvist_shaping.amplitudes import modified, ripple
from tvist_shaping.impulse_train import Impulses, check_mode

V = 0.05
"""Residual vibration that the extra-insensitive shapers permit [-]."""


@compiled
def decay(a: Floats, periods: Floats, f_d: float, zeta: float, A: Floats, tau: Floats) -> None:
    """Apply damping to the amplitudes of an undamped shaper: A_j decays by as much as the mode does until τ_j.

    A_j = a_j exp(-2π ζ/√(1-ζ²) τ_j f_d), normalised [-], and τ_j [s]. The caller has checked the mode.
    """
    rate = -2.0 * math.pi * zeta / math.sqrt(1.0 - zeta * zeta)
    total = 0.0
    for j in range(a.shape[0]):
        A[j] = a[j] * math.exp(rate * periods[j])
        total += A[j]
    for j in range(a.shape[0]):
        A[j] /= total
        tau[j] = periods[j] / f_d


_decay: Callable[..., None] = decay.py_func  # type: ignore[attr-defined]


class Train(NamedTuple):
    """An undamped shaper, from which `decay` computes the impulses of a mode."""

    a: Floats
    """Amplitudes [-], shape (N,), sum positive."""
    periods: Floats
    """Times in damped periods [-], shape (N,), ascending from 0."""

    @classmethod
    def spaced(cls, a: Sequence[float], distance: float) -> "Train":
        """Return impulses a_j that are `distance` damped periods apart."""
        return cls(np.array(a, dtype=float), distance * np.arange(float(len(a))))

    def of(self, f_d: float, zeta: float) -> Impulses:
        """Return the impulses of a mode, f_d [Hz] and ζ [-], that the caller has checked."""
        A, tau = np.empty((2, len(self.a)))
        # Not the compiled one, which would take longer to load.
        _decay(self.a, self.periods, f_d, zeta, A, tau)
        return Impulses._by_construction(A, tau)  # noqa: SLF001  both come from this package

    def at(self, f_d: float, zeta: float) -> Impulses:
        """Check a mode and return its impulses."""
        check_mode(f_d, zeta)
        return self.of(f_d, zeta)


NONE = Train.spaced((1.0,), 0.0)
ZV = Train.spaced((1.0, 1.0), 0.5)
ZVD = Train.spaced((1.0, 2.0, 1.0), 0.5)
ZVDD = Train.spaced((1.0, 3.0, 3.0, 1.0), 0.5)
ZVDDD = Train.spaced((1.0, 4.0, 6.0, 4.0, 1.0), 0.5)
MZV = Train.spaced(modified(3, 0.75).tolist(), 0.375)
EI, EI2, EI3 = (Train.spaced(ripple(humps, V).tolist(), 0.5) for humps in (1, 2, 3))
# The result of `specified(0.75, 1.25, V)`, which would take longer than all other imports together.
SI = Train(
    np.array([0.16990040201608808, 0.3300995979839119, 0.3300995979839119, 0.16990040201608808]),
    np.array([0.0, 0.420881413088327, 0.8251686762703891, 1.246050089358716]),
)


def none(f_d: float, zeta: float) -> Impulses:
    """No shaping: the single impulse A = (1), τ = (0).

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6; checked, then ignored.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1; checked, then ignored.

    Returns:
        A [-] and τ [s], each of shape (1,).

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return NONE.at(f_d, zeta)


def zv(f_d: float, zeta: float) -> Impulses:
    """Zero-vibration shaper, eqs. (4)-(7) of the paper (Singer and Seering, 1990).

    The second impulse starts an oscillation half a damped period later, in opposite phase to that of the first one,
    which has decayed by K = exp(-ζπ/√(1-ζ²)) by then.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A = (1, K)/(1+K) [-] and τ = (0, 1/(2 f_d)) [s], each of shape (2,).

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return ZV.at(f_d, zeta)


def zvd(f_d: float, zeta: float) -> Impulses:
    """Zero-vibration-and-derivative shaper (Singer and Seering, 1990): zv convolved with itself.

    The residual vibration and its derivative with respect to frequency vanish at f_d.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A = (1, 2K, K²)/(1+K)² [-] and τ = (0, 1/2, 1)/f_d [s], each of shape (3,), with K as for `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return ZVD.at(f_d, zeta)


def zvdd(f_d: float, zeta: float) -> Impulses:
    """Zero vibration and its first two derivatives by frequency (Singer and Seering, 1990): three zv in series.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A = (1, 3K, 3K², K³)/(1+K)³ [-] and τ = (0, 1/2, 1, 3/2)/f_d [s], each of shape (4,), with K as for `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return ZVDD.at(f_d, zeta)


def zvddd(f_d: float, zeta: float) -> Impulses:
    """Zero vibration and its first three derivatives by frequency (Singer and Seering, 1990): four zv in series.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A = (1, 4K, 6K², 4K³, K⁴)/(1+K)⁴ [-] and τ = (0, 1/2, 1, 3/2, 2)/f_d [s], each of shape (5,); K as for
        `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return ZVDDD.at(f_d, zeta)


def mzv(f_d: float, zeta: float) -> Impulses:
    """Modified zero-vibration shaper MZV(3, 3/4): three impulses in three quarters of a period (known from Klipper).

    It is shorter than zvd and wider than zv, more so above f_d than below it. `mzv_of` creates the other variants.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A ∝ (1 - 1/√2, (√2 - 1) k, (1 - 1/√2) k²) [-] with k = exp(-3/4 ζπ/√(1-ζ²)), and
        τ = (0, 3/8, 3/4)/f_d [s], each of shape (3,).

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return MZV.at(f_d, zeta)


def ei(f_d: float, zeta: float) -> Impulses:
    """Extra-insensitive shaper with V = 5 % (Singhose, Seering, Singer, J. Mech. Design 116, 1994).

    It leaves V at f_d and is zero at one frequency on either side, so that the band within V is as wide as possible
    with three impulses. Without damping, its residual is |(1-V)/2 + (1+V)/2 cos(π f/f_d)|.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A ∝ ((1+V)/4, (1-V)/2 K, (1+V)/4 K²) [-] and τ = (0, 1/2, 1)/f_d [s], each of shape (3,);
        K as for `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return EI.at(f_d, zeta)


def ei2(f_d: float, zeta: float) -> Impulses:
    """Two-hump extra-insensitive shaper with V = 5 %.

    It is zero at f_d and at one frequency on either side, with humps of height V in between (Singhose, Porter,
    Tuttle, Singer, J. Dyn. Sys. Meas. Control 119, 1997).

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A ∝ (a, bK, bK², aK³) [-] with a = (3X²+2X+3V²)/(16X), X = ∛(V²(√(1-V²)+1)), b = 1/2 - a, and
        τ = (0, 1/2, 1, 3/2)/f_d [s], each of shape (4,); K as for `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return EI2.at(f_d, zeta)


def ei3(f_d: float, zeta: float) -> Impulses:
    """Three-hump extra-insensitive shaper, V = 5 % (source as for `ei2`).

    It leaves V at f_d and is zero at two frequencies on either side, with humps of height V in between.

    Args:
        f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
        zeta: Damping ratio of the mode [-], 0 <= ζ < 1.

    Returns:
        A ∝ (a, bK, cK², bK³, aK⁴) [-] with a = (1+3V+2√(2(V+V²)))/16, b = (1-V)/4, c = 1 - 2(a+b), and
        τ = (0, 1/2, 1, 3/2, 2)/f_d [s], each of shape (5,); K as for `zv`.

    Raises:
        ShaperRangeError: f_d or ζ is outside the range above.
    """
    return EI3.at(f_d, zeta)

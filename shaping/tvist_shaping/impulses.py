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
from dataclasses import dataclass

import numpy as np

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.amplitudes import modified, ripple
from tvist_shaping.impulse_train import Impulses, check_mode

V = 0.05  # residual vibration that the extra-insensitive shapers permit [-]


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


@dataclass(frozen=True, eq=False, slots=True)
class Train:
    """An undamped shaper, which a call turns into the impulses of a damped mode by `decay`."""

    a: Floats  # amplitudes [-], shape (N,), sum positive
    periods: Floats  # times in damped periods [-], shape (N,), ascending from 0
    zeta_max: float = 1.0  # damping ratios must stay below this [-]
    instead: str = ""  # what to use for higher damping ratios

    @classmethod
    def spaced(cls, a: Sequence[float] | Floats, distance: float) -> "Train":
        """Return impulses a_j that are `distance` damped periods apart."""
        return cls(np.array(a, dtype=float), distance * np.arange(float(len(a))))

    @property
    def duration_periods(self) -> float:
        """Time of the last impulse in damped periods [-]."""
        return float(self.periods[-1])

    def __call__(self, f_d: float, zeta: float) -> Impulses:
        """Return the impulses of a mode.

        Args:
            f_d: Damped frequency of the mode [Hz], 1e-6 to 1e6.
            zeta: Damping ratio of the mode [-], 0 <= ζ < `zeta_max`.

        Raises:
            ShaperRangeError: f_d or ζ is outside the range above.
        """
        check_mode(f_d, zeta, self.zeta_max, self.instead)
        A, tau = np.empty((2, len(self.a)))
        # Call the Python function, since loading the compiled one would take longer.
        _decay(self.a, self.periods, f_d, zeta, A, tau)
        return Impulses._by_construction(A, tau)  # noqa: SLF001  both come from this package


none = Train.spaced((1.0,), 0.0)
"""No shaping: the single impulse A = (1), τ = (0)."""
zv = Train.spaced((1.0, 1.0), 0.5)
"""Zero-vibration shaper, eqs. (4)-(7) of the paper (Singer and Seering, 1990).

The second impulse starts an oscillation half a damped period later, in opposite phase to that of the first
one, which has decayed by K = exp(-ζπ/√(1-ζ²)) by then: A = (1, K)/(1+K) [-] and τ = (0, 1/(2 f_d)) [s].
"""
zvd = Train.spaced((1.0, 2.0, 1.0), 0.5)
"""Zero-vibration-and-derivative shaper (Singer and Seering, 1990): zv convolved with itself.

The residual vibration and its derivative with respect to frequency vanish at f_d.
"""
zvdd = Train.spaced((1.0, 3.0, 3.0, 1.0), 0.5)
"""Zero vibration and its first two derivatives by frequency (Singer and Seering, 1990): three zv in series."""
zvddd = Train.spaced((1.0, 4.0, 6.0, 4.0, 1.0), 0.5)
"""Zero vibration and its first three derivatives by frequency (Singer and Seering, 1990): four zv in series."""
mzv = Train.spaced(modified(3, 0.75), 0.375)
"""Modified zero-vibration shaper MZV(3, 3/4): three impulses in three quarters of a period (known from Klipper).

It is shorter than zvd and wider than zv, more so above f_d than below it. `mzv_of` creates the other
variants. Without damping, A ∝ (1 - 1/√2, √2 - 1, 1 - 1/√2) [-].
"""
ei = Train.spaced(ripple(1, V), 0.5)
"""Extra-insensitive shaper with V = 5 % (Singhose, Seering, Singer, J. Mech. Design 116, 1994).

It leaves V at f_d and is zero at one frequency on either side, so that the band within V is as wide as
possible with three impulses. Without damping, A = ((1+V)/4, (1-V)/2, (1+V)/4) [-] and its residual is
|(1-V)/2 + (1+V)/2 cos(π f/f_d)|.
"""
ei2 = Train.spaced(ripple(2, V), 0.5)
"""Two-hump extra-insensitive shaper with V = 5 %.

It is zero at f_d and at one frequency on either side, with humps of height V in between (Singhose, Porter,
Tuttle, Singer, J. Dyn. Sys. Meas. Control 119, 1997). Without damping, A = (a, b, b, a) [-] with X =
∛(V²(√(1-V²)+1)), a = (3X²+2X+3V²)/(16X) and b = 1/2 - a.
"""
ei3 = Train.spaced(ripple(3, V), 0.5)
"""Three-hump extra-insensitive shaper, V = 5 % (source as for `ei2`).

It leaves V at f_d and is zero at two frequencies on either side, with humps of height V in between. Without
damping, A = (a, b, c, b, a) [-] with a = (1+3V+2√(2(V+V²)))/16, b = (1-V)/4 and c = 1 - 2(a+b).
"""
# The result of `specified(0.75, 1.25, V)`, which would take longer than all other imports together.
SI = Train(
    np.array([0.16990040201608808, 0.3300995979839119, 0.3300995979839119, 0.16990040201608808]),
    np.array([0.0, 0.420881413088327, 0.8251686762703891, 1.246050089358716]),
)

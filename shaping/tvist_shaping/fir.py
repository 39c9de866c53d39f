"""A short positive filter against several modes: weights of the newest samples, found by a small quadratic programme.

For poles s_k = -σ_k ± iω_k and weights h_n ≥ 0 at t_n = n h₀, what remains of mode k after the last weight is

    E_k = Σ_n h_n exp(σ_k (t_n - T)) (cos ω_k t_n, sin ω_k t_n).

The programme asks for little of it with little energy in the weights, at a fixed sum and mean delay:

    min  ρ T/(2 h₀) Σ h_n²/g_n + ½ Σ_k w_k |E_k|²     over h ≥ 0, Σ h_n = 1, Σ h_n t_n = D,

g_n = clip((T - t_n)/EDGE, 0, 1) letting weights fade out towards the length T. Each of the lower modes stands in it
twice, a little lower and a little higher than it is believed to be, which makes the filter forgive errors. The dual
has one unknown a row and no constraints; Newton's method solves it in a few steps from where it was a moment ago.
T follows slowly: longer where more remains than is allowed, shorter where less does.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tvist_shaping._compiled import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import FilterError

EDGE = 0.012
"""Over which the weights fade out at the end [s]."""
ENERGY = 0.01
"""ρ: price of the energy in the weights [-]."""
STEPS = 60
"""Newton steps before it begins anew from cold."""
SOLVED = 1e-9
"""Residual of the dual's gradient that counts as zero [-]."""
SCALE = 0.03
"""Scale of the mean delay's row, so that all rows have the same magnitude [s]."""
QUICKEST = 0.15
"""Largest change of the length in its own seconds a second [-]."""
GAIN = 0.3
"""Gain of the servo for the length [-]."""


@dataclass(frozen=True)
class FirDesign:
    """What the filter is to reach; one entry a mode.

    Raises:
        FilterError: The tuples differ in length or are empty, or a number is out of range.
    """

    spread: tuple[float, ...] = (0.015, 0.02, 0.03, 0.0)
    """How far a mode may be off, either way; 0: it stands in the programme once [-]."""
    residual: tuple[float, ...] = (0.05, 0.05, 0.08, 0.2)
    """What may remain of it [-]."""
    weight: tuple[float, ...] = (1000.0, 1000.0, 200.0, 50.0)
    """Its price w [-]."""
    shortest: float = 0.05
    """Bounds of the length [s]."""
    longest: float = 0.15
    """[s]"""

    def __post_init__(self) -> None:
        """Check what the compiled programme takes for granted."""
        for name, least in (("spread", 0.0), ("residual", 1e-6), ("weight", 1e-6)):
            values = getattr(self, name)
            if not len(values) == len(self.spread) >= 1:
                raise FilterError(
                    name, len(values), f"one number per mode, {max(len(self.spread), 1)} in all"
                )
            for value in values:
                if not least <= value < math.inf:
                    raise FilterError(name, value, f"finite and at least {least:g}")
        if not EDGE < self.shortest <= self.longest < math.inf:
            raise FilterError(
                "shortest", self.shortest, f"above {EDGE:g} s and at most longest, {self.longest:g} s"
            )

    @property
    def modes(self) -> int:
        """Number of modes."""
        return len(self.spread)

    @property
    def rows(self) -> int:
        """Number of rows of the programme."""
        return 2 + 2 * sum(2 if spread > 0.0 else 1 for spread in self.spread)


class Programme(NamedTuple):
    """One design's quadratic programme of R rows: what it wants, its last solution, and room to solve it in."""

    spread: Floats
    """`spread` of `FirDesign`, shape (modes,)."""
    weight: Floats
    """`weight` of `FirDesign`, shape (modes,)."""
    dual: Floats
    """Unknowns of the dual, shape (R,): where to begin; the solution afterwards."""
    taps: Floats
    """Result, shape (N,), sum 1."""
    remains: Floats
    """What remains of each mode, root of the sum of squares over its rows [-], shape (modes,)."""
    rows: Floats
    """Scratch, shape (R, N)."""
    hessian: Floats
    """Scratch, shape (R, R + 2)."""

    @classmethod
    def of(cls, wanted: FirDesign, taps: int) -> "Programme":
        """The programme of a design, without a solution."""
        R = wanted.rows
        return cls(
            spread=np.array(wanted.spread, dtype=float),
            weight=np.array(wanted.weight, dtype=float),
            dual=np.zeros(R),
            taps=np.zeros(taps),
            remains=np.zeros(wanted.modes),
            rows=np.zeros((R, taps)),
            hessian=np.zeros((R, R + 2)),
        )

    def fork(self) -> "Programme":
        """A copy with the present solution."""
        return self._replace(
            dual=self.dual.copy(),
            taps=self.taps.copy(),
            remains=self.remains.copy(),
            rows=np.empty_like(self.rows),
            hessian=np.empty_like(self.hessian),
        )


@compiled
def solve(  # noqa: C901, PLR0912, PLR0915 - one kernel: its branches are loops over rows and weights
    f_d: Floats, zeta: Floats, length: float, mean: float, period: float, programme: Programme
) -> bool:
    """The weights for modes and a length.

    Args:
        f_d: Damped frequencies [Hz], shape (modes,).
        zeta: Damping ratios [-], shape (modes,).
        length: T [s].
        mean: Mean delay D [s].
        period: h₀ [s].
        programme: What is wanted; its `dual`, `taps` and `remains` are changed.

    Returns:
        Whether it was solved; otherwise taps are the best there are.
    """
    spread, weight, dual, taps, remains, rows, hessian = programme
    R, N, modes = dual.shape[0], taps.shape[0], f_d.shape[0]
    room = np.zeros(N)
    price = np.zeros(R)
    for n in range(N):
        t = n * period
        room[n] = min(max((length - t) / EDGE, 0.0), 1.0) * period / (ENERGY * length)
        rows[0, n] = 1.0
        rows[1, n] = (t - mean) / SCALE
    row = 2
    for k in range(modes):
        omega = 2.0 * math.pi * f_d[k]
        sigma = omega * zeta[k] / math.sqrt(1.0 - zeta[k] * zeta[k])
        for side in range(2 if spread[k] > 0.0 else 1):
            factor = 1.0 + (2 * side - 1) * spread[k] if spread[k] > 0.0 else 1.0
            # A weight a tick further is a turn and a growth further: no sine has to be computed.
            turn = np.exp(complex(sigma * factor * period, omega * factor * period))
            value = complex(math.exp(-sigma * factor * length), 0.0)
            for n in range(N):
                rows[row, n], rows[row + 1, n] = value.real, value.imag
                value *= turn
            price[row] = price[row + 1] = 1.0 / weight[k]
            row += 2
    solved = False
    for attempt in range(2):
        if attempt == 1:
            dual[:] = 0.0
            dual[0] = ENERGY
        value = _ascend(dual, rows, room, price, taps)
        for _ in range(STEPS):
            if _gradient(dual, rows, price, taps, hessian) <= SOLVED:  # not so where it is no number
                solved = True
                break
            if not _newton(rows, room, price, taps, hessian):
                break
            slope = 0.0
            for i in range(R):
                slope += hessian[i, R] * hessian[i, R + 1]
            start, found = dual.copy(), value
            step = 1.0
            for _ in range(30):
                for i in range(R):
                    dual[i] = start[i] + step * hessian[i, R + 1]
                found = _ascend(dual, rows, room, price, taps)
                if found >= value + 1e-4 * step * slope:
                    break
                step *= 0.5
            value = found
        if solved:
            break
    total = taps.sum()
    if not total > 0.0:
        return False
    for n in range(N):
        taps[n] /= total
    row = 2
    for k in range(modes):
        remains[k] = 0.0
        for _ in range(4 if spread[k] > 0.0 else 2):
            along = 0.0
            for n in range(N):
                along += rows[row, n] * taps[n]
            remains[k] += along * along
            row += 1
        remains[k] = math.sqrt(remains[k])
    return solved


@compiled
def _ascend(dual: Floats, rows: Floats, room: Floats, price: Floats, taps: Floats) -> float:
    """Value of the dual, and the weights that belong to it."""
    R, N = rows.shape
    value = float(dual[0])
    for i in range(R):
        value -= 0.5 * price[i] * dual[i] * dual[i]
    for n in range(N):
        taps[n] = 0.0
        if room[n] > 0.0:
            along = 0.0
            for i in range(R):
                along += rows[i, n] * dual[i]
            if along > 0.0:
                taps[n] = room[n] * along
                value -= 0.5 * room[n] * along * along
    return value


@compiled
def _gradient(dual: Floats, rows: Floats, price: Floats, taps: Floats, hessian: Floats) -> float:
    """Length of the dual's gradient, which is left in the column before the last."""
    R, N = rows.shape
    square = 0.0
    for i in range(R):
        gradient = -price[i] * dual[i]
        if i == 0:
            gradient += 1.0
        for n in range(N):
            gradient -= rows[i, n] * taps[n]
        hessian[i, R] = gradient
        square += gradient * gradient
    return math.sqrt(square)


@compiled
def _newton(rows: Floats, room: Floats, price: Floats, taps: Floats, hessian: Floats) -> bool:  # noqa: C901, PLR0912  a kernel
    """Newton's step into the last column, by Cholesky's factors."""
    R, N = rows.shape
    for i in range(R):
        for j in range(i + 1):
            entry = 0.0
            for n in range(N):
                if taps[n] > 0.0:
                    entry += rows[i, n] * room[n] * rows[j, n]
            hessian[i, j] = entry
        hessian[i, i] += price[i] + 1e-12
    for i in range(R):
        for j in range(i + 1):
            entry = hessian[i, j]
            for k in range(j):
                entry -= hessian[i, k] * hessian[j, k]
            if i == j:
                if not entry > 0.0:
                    return False
                hessian[i, i] = math.sqrt(entry)
            else:
                hessian[i, j] = entry / hessian[j, j]
    for i in range(R):
        entry = hessian[i, R]
        for k in range(i):
            entry -= hessian[i, k] * hessian[k, R + 1]
        hessian[i, R + 1] = entry / hessian[i, i]
    for i in range(R - 1, -1, -1):
        entry = hessian[i, R + 1]
        for k in range(i + 1, R):
            entry -= hessian[k, i] * hessian[k, R + 1]
        hessian[i, R + 1] = entry / hessian[i, i]
    return True

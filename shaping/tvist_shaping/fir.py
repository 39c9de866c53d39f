"""A short positive filter against several modes: weights of the newest samples from a small quadratic programme.

For poles s_k = -σ_k ± iω_k and weights h_n ≥ 0 at t_n = n h₀, the residual of mode k after the last weight is

    E_k = Σ_n h_n exp(σ_k (t_n - T)) (cos ω_k t_n, sin ω_k t_n).

The programme minimises this residual and the energy in the weights, for a given sum and mean delay:

    min  ρ T/(2 h₀) Σ h_n²/g_n + ½ Σ_k w_k |E_k|²     over h ≥ 0, Σ h_n = 1, Σ h_n t_n = D,

with g_n = clip((T - t_n)/EDGE, 0, 1), which makes the weights fade out towards the length T. Each of the lower modes
has two terms, at a slightly lower and a slightly higher frequency than estimated, so that the filter tolerates errors.
The dual has one unknown per row and no constraints; Newton's method solves it in a few steps from the previous
solution. T follows slowly: it increases while the residual exceeds the permitted one, otherwise decreases.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats
from tvist_shaping.errors import FilterError

EDGE = 0.012  # length of the fade-out of the weights at the end [s]
ENERGY = 0.01  # ρ: weight of the energy in the weights [-]
STEPS = 60  # number of Newton steps before a restart from zero
SOLVED = 1e-9  # norm of the dual's gradient that counts as zero [-]
SCALE = 0.03  # scale of the mean delay's row, so that all rows have the same magnitude [s]
QUICKEST = 0.15  # largest relative change of the length per second [1/s]
GAIN = 0.3  # gain of the control loop for the length [-]


@dataclass(frozen=True)
class FirDesign:
    """Requirements for the filter, with one entry for each mode.

    Raises:
        FilterError: The tuples are empty or have different lengths, or a value is out of range.
    """

    spread: tuple[float, ...] = (0.015, 0.02, 0.03, 0.0)
    """Relative error of a mode's frequency to tolerate, in both directions; 0 for a single term [-]."""
    residual: tuple[float, ...] = (0.05, 0.05, 0.08, 0.2)
    """Permitted residual of each mode [-]."""
    weight: tuple[float, ...] = (1000.0, 1000.0, 200.0, 50.0)
    """Weight w of each mode's residual [-]."""
    shortest: float = 0.05
    """Shortest length [s]."""
    longest: float = 0.15
    """Longest length [s]."""

    def __post_init__(self) -> None:
        """Check what the compiled functions rely on."""
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


class QuadraticProgramme(NamedTuple):
    """Quadratic programme of a design with R rows: requirements, latest solution, and working memory."""

    spread: Floats  # `spread` of `FirDesign`, shape (modes,)
    weight: Floats  # `weight` of `FirDesign`, shape (modes,)
    dual: Floats  # unknowns of the dual, shape (R,): the initial guess, then the solution
    taps: Floats  # result, shape (N,), with sum 1
    remains: Floats
    """Residual of each mode, as the root of the sum of squares over its rows [-], shape (modes,)."""
    rows: Floats  # scratch, shape (R, N)
    columns: Floats  # scratch: `rows` transposed, shape (N, R)
    hessian: Floats  # scratch, shape (R, R + 2)

    @classmethod
    def of(cls, wanted: FirDesign, taps: int) -> "QuadraticProgramme":
        """Create the programme of a design, without a solution."""
        R = 2 + 2 * sum(2 if spread > 0.0 else 1 for spread in wanted.spread)
        return cls(
            spread=np.array(wanted.spread, dtype=float),
            weight=np.array(wanted.weight, dtype=float),
            dual=np.zeros(R),
            taps=np.zeros(taps),
            remains=np.zeros(wanted.modes),
            rows=np.zeros((R, taps)),
            columns=np.zeros((taps, R)),
            hessian=np.zeros((R, R + 2)),
        )

    def fork(self) -> "QuadraticProgramme":
        """Return a copy with the present solution."""
        return QuadraticProgramme(*(part.copy() for part in self))


@compiled
def solve(  # noqa: C901, PLR0912, PLR0915 - one kernel: its branches are loops over rows and weights
    f_d: Floats, zeta: Floats, length: float, mean: float, period: float, programme: QuadraticProgramme
) -> bool:
    """Compute the weights for given modes, length [s] and mean delay [s].

    Store the result in `dual`, `taps` and `remains` of the programme. Return whether the programme was
    solved; otherwise the taps are the best ones found.
    """
    spread, weight, dual, taps, remains, rows, columns, hessian = programme
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
            # Each tick multiplies the term by a constant rotation and growth, so no sine has to be computed.
            turn = np.exp(complex(sigma * factor * period, omega * factor * period))
            value = complex(math.exp(-sigma * factor * length), 0.0)
            for n in range(N):
                rows[row, n], rows[row + 1, n] = value.real, value.imag
                value *= turn
            price[row] = price[row + 1] = 1.0 / weight[k]
            row += 2
    for n in range(N):
        for i in range(R):
            columns[n, i] = rows[i, n]
    solved = False
    for attempt in range(2):
        if attempt == 1:
            dual[:] = 0.0
            dual[0] = ENERGY
        value = _ascend(dual, rows, room, price, taps)
        for _ in range(STEPS):
            if _gradient(dual, columns, price, taps, hessian) <= SOLVED:  # False for NaN
                solved = True
                break
            if not _newton(columns, room, price, taps, hessian):
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
    """Return the value of the dual, and compute the corresponding weights."""
    R, N = rows.shape
    value = float(dual[0])
    for n in range(N):
        taps[n] = 0.0
    for i in range(R):
        value -= 0.5 * price[i] * dual[i] * dual[i]
        for n in range(N):
            taps[n] += rows[i, n] * dual[i]
    for n in range(N):
        along = max(taps[n], 0.0)
        taps[n] = room[n] * along
        value -= 0.5 * room[n] * along * along
    return value


@compiled
def _gradient(dual: Floats, columns: Floats, price: Floats, taps: Floats, hessian: Floats) -> float:
    """Return the norm of the dual's gradient, which is stored in the last but one column of `hessian`."""
    N, R = columns.shape
    gradient = np.empty(R)
    for i in range(R):
        gradient[i] = -price[i] * dual[i]
    gradient[0] += 1.0
    for n in range(N):
        if taps[n] > 0.0:
            for i in range(R):
                gradient[i] -= columns[n, i] * taps[n]
    square = 0.0
    for i in range(R):
        hessian[i, R] = gradient[i]
        square += gradient[i] * gradient[i]
    return math.sqrt(square)


@compiled
def _newton(columns: Floats, room: Floats, price: Floats, taps: Floats, hessian: Floats) -> bool:  # noqa: C901, PLR0912  a kernel
    """Compute Newton's step into the last column of `hessian`, by Cholesky factorisation."""
    N, R = columns.shape
    for i in range(R):
        for j in range(i + 1):
            hessian[i, j] = 0.0
    # Weight by weight, so that SIMD can treat several entries at once without changing the order of additions.
    for n in range(N):
        if taps[n] > 0.0:
            for i in range(R):
                weighted = columns[n, i] * room[n]
                for j in range(i + 1):
                    hessian[i, j] += weighted * columns[n, j]
    for i in range(R):
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

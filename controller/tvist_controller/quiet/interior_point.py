"""Interior-point method for programmes in the velocity of a motion, whose constraints are differences of neighbours.

The unknowns c_1 … c_K are velocities at even steps of time, with zeros before and after them. Their first differences
are steps of velocity, their second differences steps of acceleration. The programme is

    min  gᵀc + ½ Σ (E c - e)²/p    over  b ≤ c ≤ 1,  |Δc| ≤ a,  |Δ²c| ≤ j,

where a price p of 0 stands for an equation, E c = e. So the matrix of Newton's method is a band of five diagonals, and
the few rows of E are eliminated by their Schur complement. A step costs K times the square of the number of rows.
(Mehrotra's predictor and corrector; Nocedal and Wright 2006, ch. 14 and 16.)
"""

from typing import NamedTuple

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.quiet.elimination import eliminate
from tvist_controller.trajectory.limits import Floats

STEPS = 60
"""Largest number of Newton steps."""
GAP = 1e-6
"""Mean product of slack and multiplier at which the programme is solved."""
CLOSE = 1e-7
"""Largest error of the equations at which it is solved."""
SHORT_OF = 0.995
"""Share of the way to the nearest bound that a step goes."""
TINY = 1e-13
"""Added to the diagonal of the Schur complement, relative to it, since rows may depend on each other."""


class Programme(NamedTuple):
    """A programme in K unknowns with R equations."""

    gain: Floats
    """g, shape (K,)."""
    lowest: float
    """b, smallest value, 0 or below."""
    first: float
    """a, largest first difference, above 0."""
    second: float
    """j, largest second difference, above 0."""
    rows: Floats
    """E, shape (R, K)."""
    wanted: Floats
    """e, shape (R,)."""
    price: Floats
    """p, shape (R,): 0 for an equation that must hold."""


@compiled
def differences(c: Floats, out: Floats) -> None:  # pragma: no cover  compiled
    """Compute c, its first and its second differences, with zeros around c.

    Args:
        c: Shape (K,).
        out: Result, shape (3, K + 2): K values, K + 1 first and K + 2 second differences.
    """
    K = c.shape[0]
    before, last = 0.0, 0.0
    for i in range(K + 2):
        now = c[i] if i < K else 0.0
        step = now - before
        out[0, i], out[1, i], out[2, i] = now, step, step - last
        before, last = now, step


@compiled
def _gather(values: Floats, out: Floats) -> None:  # pragma: no cover  compiled
    """Add the transpose of `differences`, applied to values of shape (3, K + 2), to `out` of shape (K,)."""
    for i in range(out.shape[0]):
        out[i] += (
            values[0, i]
            + (values[1, i] - values[1, i + 1])
            + (values[2, i] - 2.0 * values[2, i + 1] + values[2, i + 2])
        )


@compiled
def _factorize(weights: Floats, band: Floats) -> bool:  # pragma: no cover  compiled
    """Compute the Cholesky factor of the band Σ w d dᵀ over all differences d; return whether it is positive."""
    K = band.shape[1]
    for i in range(K):
        w1, w2 = weights[1], weights[2]
        band[0, i] = weights[0, i] + w1[i] + w1[i + 1] + w2[i] + 4.0 * w2[i + 1] + w2[i + 2]
        band[1, i] = -w1[i] - 2.0 * (w2[i] + w2[i + 1]) if i >= 1 else 0.0
        band[2, i] = w2[i] if i >= 2 else 0.0
    for i in range(K):
        if i >= 2:
            band[2, i] /= band[0, i - 2]
            band[1, i] -= band[2, i] * band[1, i - 1]
        if i >= 1:
            band[1, i] /= band[0, i - 1]
        rest = band[0, i] - band[1, i] ** 2 - band[2, i] ** 2
        if not rest > 0.0:
            return False
        band[0, i] = np.sqrt(rest)
    return True


@compiled
def _solve(band: Floats, x: Floats) -> None:  # pragma: no cover  compiled
    """Solve with the factor in place, x of shape (K,)."""
    K = x.shape[0]
    for i in range(K):
        if i >= 2:
            x[i] -= band[2, i] * x[i - 2]
        if i >= 1:
            x[i] -= band[1, i] * x[i - 1]
        x[i] /= band[0, i]
    for i in range(K - 1, -1, -1):
        if i + 1 < K:
            x[i] -= band[1, i + 1] * x[i + 1]
        if i + 2 < K:
            x[i] -= band[2, i + 2] * x[i + 2]
        x[i] /= band[0, i]


def inside(count: int, first: float, second: float) -> Floats:
    """Return values strictly within the bounds of a programme, from which the method converges, shape (count,)."""
    c: Floats = np.sin(np.pi * np.arange(1, count + 1) / (count + 1)) ** 2
    found = np.zeros((3, count + 2))
    differences(c, found)
    most = np.abs(found).max(axis=1)
    c *= 0.5 / max(float(most[0]), float(most[1]) / first, float(most[2]) / second)
    return c


def rehearse() -> None:
    """Compile the method."""
    few = np.zeros((1, 8))
    optimize(Programme(-np.ones(8), 0.0, 0.1, 0.01, few, np.zeros(1), np.ones(1)), inside(8, 0.1, 0.01))


@compiled
def optimize(  # noqa: C901, PLR0912, PLR0915  a kernel: its branches are loops
    programme: Programme, c: Floats
) -> bool:  # pragma: no cover  compiled
    """Solve a programme.

    Args:
        programme: The programme.
        c: Initial values strictly within all bounds, shape (K,); afterwards the solution, which keeps them.

    Returns:
        Whether it was solved. Otherwise the values are within the bounds, but E c differs from e.
    """
    gain, lowest, first, second, E, e, price = programme
    K, R = c.shape[0], E.shape[0]
    N, soft = K + 2, R > 0 and price.max() > 0.0
    high = np.array([1.0, first, second])
    low = -high
    low[0] = lowest
    counts = np.array([K, K + 1, K + 2])
    total = 2.0 * (3 * K + 3)
    value, change = np.zeros((3, N)), np.zeros((3, N))
    above, below = np.zeros((3, N)), np.zeros((3, N))  # multipliers
    d_above, d_below = np.zeros((3, N)), np.zeros((3, N))
    weights, right = np.zeros((3, N)), np.zeros((3, N))
    up, down = np.zeros((3, N)), np.zeros((3, N))  # products of slack and multiplier to aim at
    band, Q = np.zeros((3, K)), np.zeros((R, K))
    y, dy, miss = np.zeros(R), np.zeros(R), np.zeros(R)
    r, dc = np.zeros(K), np.zeros(K)
    S, rest = np.zeros((R, R)), np.zeros((R, R))
    differences(c, value)
    for k in range(3):
        for i in range(counts[k]):
            above[k, i] = 1.0 / (high[k] - value[k, i])
            below[k, i] = 1.0 / (value[k, i] - low[k])
    for _ in range(STEPS):
        gap = 0.0
        for k in range(3):
            for i in range(counts[k]):
                gap += above[k, i] * (high[k] - value[k, i]) + below[k, i] * (value[k, i] - low[k])
        gap /= total
        worst = 0.0
        for m in range(R):
            miss[m] = e[m] + price[m] * y[m]
            for i in range(K):
                miss[m] -= E[m, i] * c[i]
            worst = max(worst, abs(miss[m]))
        if gap < GAP and worst < CLOSE:
            return True
        for k in range(3):
            for i in range(counts[k]):
                weights[k, i] = above[k, i] / (high[k] - value[k, i]) + below[k, i] / (value[k, i] - low[k])
        if not _factorize(weights, band):
            return False
        for m in range(R):
            Q[m] = E[m]
            _solve(band, Q[m])
        for m in range(R):
            for j in range(R):
                S[m, j] = 0.0
                for i in range(K):
                    S[m, j] += E[m, i] * Q[j, i]
            S[m, m] *= 1.0 + TINY
            S[m, m] += price[m] + 1e-300
        centre = 0.0
        for attempt in range(2):
            for k in range(3):
                for i in range(counts[k]):
                    up[k, i] = centre + attempt * change[k, i] * d_above[k, i]
                    down[k, i] = centre - attempt * change[k, i] * d_below[k, i]
                    room, base = high[k] - value[k, i], value[k, i] - low[k]
                    right[k, i] = down[k, i] / base - up[k, i] / room
            for i in range(K):
                r[i] = -gain[i]
                for m in range(R):
                    r[i] -= E[m, i] * y[m]
            _gather(right, r)
            dc[:] = r
            _solve(band, dc)
            if R > 0:
                for m in range(R):
                    dy[m] = -miss[m]
                    for i in range(K):
                        dy[m] += E[m, i] * dc[i]
                rest[:] = S
                eliminate(rest, dy)
                for m in range(R):
                    for i in range(K):
                        dc[i] -= Q[m, i] * dy[m]
            differences(dc, change)
            primal, dual = 1.0, 1.0
            for k in range(3):
                for i in range(counts[k]):
                    room, base = high[k] - value[k, i], value[k, i] - low[k]
                    d_above[k, i] = (up[k, i] + above[k, i] * change[k, i]) / room - above[k, i]
                    d_below[k, i] = (down[k, i] - below[k, i] * change[k, i]) / base - below[k, i]
                    if change[k, i] > 0.0:
                        primal = min(primal, SHORT_OF * room / change[k, i])
                    elif change[k, i] < 0.0:
                        primal = min(primal, -SHORT_OF * base / change[k, i])
                    if d_above[k, i] < 0.0:
                        dual = min(dual, -SHORT_OF * above[k, i] / d_above[k, i])
                    if d_below[k, i] < 0.0:
                        dual = min(dual, -SHORT_OF * below[k, i] / d_below[k, i])
            if soft:  # the equations' errors depend on c and y, so both take the same step
                primal = dual = min(primal, dual)
            if attempt == 0:
                left = 0.0
                for k in range(3):
                    for i in range(counts[k]):
                        step = primal * change[k, i]
                        left += (above[k, i] + dual * d_above[k, i]) * (high[k] - value[k, i] - step)
                        left += (below[k, i] + dual * d_below[k, i]) * (value[k, i] - low[k] + step)
                centre = gap * max((left / total / gap) ** 2, 0.05)
        for i in range(K):
            c[i] += primal * dc[i]
        for m in range(R):
            y[m] += dual * dy[m]
        for k in range(3):
            for i in range(counts[k]):
                above[k, i] += dual * d_above[k, i]
                below[k, i] += dual * d_below[k, i]
        differences(c, value)
    return False

"""Taps, the weights of the newest samples, which filters with constant mean delay use instead of impulses.

Taps h_n, n = 0 … N-1, at delays of n ticks are equivalent to impulses between ticks, each distributed over four taps by
Lagrange's cubic. Unlike impulses they can be averaged: the mean of tap vectors has the mean of their sums and mean
delays.
"""

import math

import numpy as np

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats

MATTERS = 1e-12  # magnitude below which a tap does not count [-]


@compiled
def mean_delay(f_d: Floats, zeta: Floats) -> float:
    """Return Σ A_j τ_j of the product of the modes' zero-vibration shapers [s]."""
    total = 0.0
    for k in range(f_d.shape[0]):
        K = math.exp(-math.pi * zeta[k] / math.sqrt(1.0 - zeta[k] * zeta[k]))
        total += K / (1.0 + K) / (2.0 * f_d[k])
    return total


@compiled
def product_taps(f_d: Floats, zeta: Floats, mean: float, period: float, taps: Floats) -> bool:
    """Compute the product of the modes' zero-vibration shapers, delayed to a mean delay [s].

    If the product's own mean delay is longer than `mean`, keep the product's. Move impulses beyond the last
    tap to the last tap. Return False in either case.
    """
    modes, N = f_d.shape[0], taps.shape[0]
    own = mean_delay(f_d, zeta)
    back = max(mean - own, 0.0)
    fits = own <= mean
    taps[:] = 0.0
    for choice in range(1 << modes):
        A, delay = 1.0, back
        for k in range(modes):
            K = math.exp(-math.pi * zeta[k] / math.sqrt(1.0 - zeta[k] * zeta[k]))
            if choice >> k & 1:
                A *= K / (1.0 + K)
                delay += 0.5 / f_d[k]
            else:
                A /= 1.0 + K
        ticks = delay / period
        if ticks > N - 3:
            fits, ticks = False, N - 3.0
        start = max(int(ticks) - 1, 0)
        s = ticks - start
        taps[start] -= A * (s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0
        taps[start + 1] += A * s * (s - 2.0) * (s - 3.0) / 2.0
        taps[start + 2] -= A * s * (s - 1.0) * (s - 3.0) / 2.0
        taps[start + 3] += A * s * (s - 1.0) * (s - 2.0) / 6.0
    return fits


@compiled
def average(taps: Floats, past: Floats, sums: Floats, row: int, out: Floats) -> int:
    """Update three running means of tap vectors in series; normalise the third to sum 1.

    `past` has the inputs of each mean, shape (3, ticks, N), whose row `row` is replaced, and `sums` their sums. Return
    the index of the last tap that matters, as `length` does.
    """
    ticks, N = past.shape[1], taps.shape[0]
    for n in range(N):
        out[n] = taps[n]
    for stage in range(3):
        for n in range(N):
            sums[stage, n] += out[n] - past[stage, row, n]
            past[stage, row, n] = out[n]
            out[n] = sums[stage, n] / ticks
        if row == 0:  # recompute regularly, so that rounding errors do not add up over days
            for n in range(N):
                fresh = 0.0
                for i in range(ticks):
                    fresh += past[stage, i, n]
                sums[stage, n] = fresh
    total = 0.0
    for n in range(N):
        total += out[n]
    last = 0
    for n in range(N):
        out[n] /= total
        if abs(out[n]) > MATTERS:
            last = n
    return last


def length(taps: Floats) -> int:
    """Return the index of the last tap that matters, which is the filter's length in ticks; 0 if none does."""
    matter = np.flatnonzero(np.abs(taps) > MATTERS)
    return int(matter[-1]) if len(matter) else 0

"""Specified insensitivity: the shortest positive train that leaves at most V anywhere in a band of frequencies.

Singhose, Seering and Singer (J. Dyn. Sys. Meas. Control 118, 1996) require V at sampled frequencies of the band, and
find the train by optimisation. Without damping the shortest train is symmetric, and its residual is the cosine sum

    R(f) = Σ a_j cos(2π f x_j),    x_j the times relative to its middle,

which touches the bound with alternating sign: +V at the lower end, then the humps. So there are as many relevant
samples as unknowns, and Newton's method moves both the samples and the train to their final positions (Remez exchange).
N impulses have N - 1 unknowns (amplitudes of sum 1, times) and N - 1 extremes. There are two cases:

* If the band is wide for N, the last extreme is a hump within the band. The train is then the extra-insensitive
  shaper of `ripple`, scaled in time such that its band starts at the requested lower end; it tolerates more than
  requested above the upper end.
* Otherwise the last extreme is the band's upper end, where the residual is not stationary. This case is solved by
  continuation from the first one downwards.
"""

import math
from functools import partial

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.amplitudes import ripple, widening
from tvist_shaping.errors import DesignError
from tvist_shaping.newton import solve

MAX_IMPULSES = 12  # largest number of impulses
STRIDE = 0.02  # change of the band's upper end that Newton's method can follow in one step [-]


def specified(low: float, high: float, V: float) -> tuple[Floats, Floats]:
    """Return the shortest train without damping: amplitudes [-], and times [inverse of the band's unit].

    The band is from low > 0 to high >= low. Raise DesignError if it is too wide or V is out of range.
    """
    ratio = high / low
    for N in range(2, MAX_IMPULSES + 1):
        a = ripple(N - 2, V)
        ends = 2.0 / math.pi * math.acos(1.0 / widening(N - 2, V))
        if ratio <= (2.0 - ends) / ends:
            break
    else:
        widest = low * (2.0 - ends) / ends
        raise DesignError(
            "band", high, f"at most {widest:g} at its upper end for {MAX_IMPULSES} impulses and this V"
        )
    # The equal-ripple shaper, in units of the lower end, so that its band starts at 1.
    x = np.asarray((np.arange(N) - (N - 1) / 2.0) / 2.0 * ends, dtype=float)
    extremes = np.cos(np.arange(1, N - 1) * math.pi / (N - 1))
    humps = 2.0 / math.pi * np.arccos(extremes / widening(N - 2, V)) / ends  # of its residual within the band
    if N > 2 and ratio < humps[-1]:
        a, x = _followed(a, x, humps, ratio, V)
    return a, (x - x[0]) / low


def _followed(a: Floats, x: Floats, humps: Floats, ratio: float, V: float) -> tuple[Floats, Floats]:
    """Solve for the train whose last extreme is the band's upper end, from one at a hump down to `ratio`, in steps."""
    N, pairs = a.size, a.size // 2
    free = (N - 1) // 2  # free amplitudes; the innermost pair or the middle one makes the sum 1
    signs = (-1.0) ** np.arange(1, N - 1)

    def parts(points: Floats) -> tuple[Floats, Floats]:
        """Return amplitudes and times of the first half; the middle is last and counts twice if it is a pair."""
        A, late = points[:, :free], points[:, free : free + pairs]
        rest = 1.0 - 2.0 * A.sum(axis=1, keepdims=True)
        if N % 2:
            return np.hstack([2.0 * A, rest]), np.hstack([late, 0.0 * rest])
        return np.hstack([2.0 * A, rest]), late

    def equations(high: float, points: Floats) -> Floats:
        A, late = parts(points)
        inner, one = points[:, free + pairs :], np.ones((len(points), 1))
        f = np.hstack([one, inner, high * one])
        angles = 2.0 * math.pi * f[:, :, None] * late[:, None]
        R = (A[:, None] * np.cos(angles)).sum(axis=-1)
        slopes = ((A * late)[:, None] * np.sin(angles[:, 1:-1])).sum(axis=-1)
        return np.hstack([R / V - np.concatenate([[1.0], signs]), slopes])

    point = np.concatenate([a[:free], x[:pairs], humps[:-1]])
    steps = math.ceil((humps[-1] - ratio) / STRIDE)
    for high in np.linspace(humps[-1], ratio, steps + 1)[1:]:
        point = solve(partial(equations, float(high)), point)
    A, late = (part[0] for part in parts(point[None]))
    middle = [A[-1]] if N % 2 else [A[-1] / 2.0, A[-1] / 2.0]
    outer = A[:-1] / 2.0
    return (
        np.concatenate([outer, middle, outer[::-1]]),
        np.concatenate([late[:pairs], late[pairs:], -late[:pairs][::-1]]),
    )

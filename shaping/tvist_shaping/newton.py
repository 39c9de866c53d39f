"""Newton's method for shapers that are defined by a few equations without a closed-form solution."""

from collections.abc import Callable

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import ConvergenceError

DIFFERENCE_STEP = 1e-7  # step of the difference quotients [-]; all unknowns here are of order one
FARTHEST = 0.2  # largest change of an unknown in one step [-]
SOLVED = 1e-12  # largest residual of an equation that counts as zero [-]


def solve(equations: Callable[[Floats], Floats], start: Floats) -> Floats:
    """Solve m equations from a close guess; `equations` maps M points to residuals, shape (M, m)."""
    x, m = np.array(start, dtype=float), len(start)
    with np.errstate(all="ignore"):  # divergence is detected below
        for _ in range(60):
            left = equations(np.vstack([x, x + DIFFERENCE_STEP * np.eye(m)]))
            if not np.isfinite(left).all():
                break
            if np.abs(left[0]).max() < SOLVED:
                return x
            try:
                change = np.linalg.solve((left[1:] - left[0]).T / DIFFERENCE_STEP, -left[0])
            except np.linalg.LinAlgError:
                break
            x = x + change * min(1.0, FARTHEST / max(float(np.abs(change).max()), 1e-300))
    raise ConvergenceError(f"Newton's method found no solution of {m} equations from {start!r}")

"""Effect of noise that is correlated in time on the accuracy of estimates."""

import numpy as np

from tvist_lab.recordings import Floats

MAX_CORRELATION = 0.97  # largest assumed correlation; beyond it, a residual is a drift [-]


def widening(residual: Floats, fitted: int = 0) -> float:
    """Return the factor on standard errors for a coloured residual, sqrt((1 + r)/(1 - r)), at least 1.

    r is the correlation of successive samples, as of a first-order autoregression. `residual` has shape (T,)
    or (T, axes), in the order of time. For each of the `fitted` slow functions of time, (1 + 3 r)/T is added
    to the correlation found (Marriott and Pope, Biometrika 41, 1954, for the mean).
    """
    energy = float(np.sum(residual**2))
    if energy <= 0.0:
        return 1.0
    r = float(np.sum(residual[1:] * residual[:-1])) / energy
    r = min(max(r + fitted * (1.0 + 3.0 * r) / len(residual), 0.0), MAX_CORRELATION)
    return float(np.sqrt((1.0 + r) / (1.0 - r)))

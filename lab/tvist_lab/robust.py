"""Design of a fixed shaper that is robust over a whole workspace."""

import numpy as np

from tvist_lab.recordings import Floats
from tvist_shaping import residual, shaper

TOLERANCE = 0.05
"""Residual vibration that a robust shaper may leave [-]."""


def robust_over(name: str, f_d: tuple[float, float], zeta: tuple[float, float]) -> tuple[float, float]:
    """Return the design of a fixed shaper for a whole workspace.

    It is the shortest one that leaves at most 5 % anywhere; if none does, the one with the smallest worst case. The
    damping ratio is assumed to fall linearly from its highest value at the lowest frequency to its lowest value at
    the highest frequency.

    Args:
        name: Name of the shaper.
        f_d: Lowest and highest damped frequency of the workspace [Hz].
        zeta: Lowest and highest damping ratio [-].

    Returns:
        Design frequency [Hz] and damping ratio [-].
    """
    frequencies = np.linspace(*f_d, 60)
    damping = _damping(frequencies, f_d, zeta)
    designs = np.linspace(*f_d, 90)
    worst = np.empty_like(designs)
    for number, design in enumerate(designs):
        impulses = shaper(name).function(float(design), float(_damping(design, f_d, zeta)))
        worst[number] = max(
            float(residual(f, z, impulses)) for f, z in zip(frequencies, damping, strict=True)
        )
    good = np.flatnonzero(worst <= TOLERANCE)
    best = designs[good[-1] if good.size else np.argmin(worst)]
    return float(best), float(_damping(best, f_d, zeta))


def _damping(f: Floats | float, f_d: tuple[float, float], zeta: tuple[float, float]) -> Floats:
    return np.asarray(np.interp(f, f_d, zeta[::-1]))

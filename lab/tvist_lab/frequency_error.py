"""Residual vibration of shapers with a wrong frequency, and the best fixed shaper for a range."""

import numpy as np

from tvist_lab.recordings import Floats
from tvist_shaping import Shaper, residual, shaper

ALLOWED = 0.05  # residual vibration at which a mode counts as settled [-]


def residual_over_error(shaper: Shaper, zeta: float, errors: Floats) -> Floats:
    """Return residual over unshaped vibration [-], for shares by which the assumed f_d is too high."""
    # `zeta` is both the assumed and the true damping ratio.
    return np.asarray(residual(1.0 / (1.0 + errors), zeta, shaper.impulses(1.0, zeta)))


def settling_time(shaper: Shaper, f_d: float, zeta: float, error: float) -> float:
    """Return the time from the unshaped stop until the mode stays below 5 % of its unshaped vibration [s].

    This is the shaper's delay plus the time in which the remaining vibration decays, infinite without
    damping; the worse sign of `error` counts.
    """
    times = []
    for side in (-error, error):
        left = float(residual_over_error(shaper, zeta, np.array([side]))[0])
        delay = shaper.impulses((1.0 + side) * f_d, zeta).duration
        over = np.log(max(left / (ALLOWED * (1.0 + 1e-4)), 1.0))  # a hump of exactly 5 % is settled
        sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
        times.append(delay + (0.0 if over == 0.0 else over / sigma if sigma else np.inf))
    return float(max(times))


def robust_over(name: str, f_d: tuple[float, float], zeta: tuple[float, float]) -> tuple[float, float]:
    """Return frequency [Hz] and damping ratio of a fixed shaper for the given ranges of a workspace."""
    # Choose the shortest design that leaves at most 5 % anywhere; if none does, the one with the smallest worst
    # case. The damping ratio is assumed to fall linearly from its highest value at the lowest frequency to
    # its lowest at the highest.
    frequencies = np.linspace(*f_d, 60)
    damping = _damping(frequencies, f_d, zeta)
    designs = np.linspace(*f_d, 90)
    worst = np.empty_like(designs)
    for number, design in enumerate(designs):
        impulses = shaper(name).function(float(design), float(_damping(design, f_d, zeta)))
        worst[number] = max(
            float(residual(f, z, impulses)) for f, z in zip(frequencies, damping, strict=True)
        )
    good = np.flatnonzero(worst <= ALLOWED)
    best = designs[good[-1] if good.size else np.argmin(worst)]
    return float(best), float(_damping(best, f_d, zeta))


def _damping(f: Floats | float, f_d: tuple[float, float], zeta: tuple[float, float]) -> Floats:
    return np.asarray(np.interp(f, f_d, zeta[::-1]))

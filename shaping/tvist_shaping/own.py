"""The user's own shapers: created from a function, and checked before anything moves."""

from collections.abc import Callable

import numpy as np

from tvist_shaping.errors import DesignError, ShaperFailureError
from tvist_shaping.failures import FAILURES, ROUNDING, failure
from tvist_shaping.fir_shaper import FirShaper
from tvist_shaping.impulses import Impulses
from tvist_shaping.shaper import Shaper

TRIED_F_D = (0.1, 200.0)
"""Range of damped frequencies for which a shaper is checked [Hz]: all that a client may send to a robot."""
_F_D = np.geomspace(*TRIED_F_D, 23)
_SHARES = np.array([*np.linspace(0.0, 1.0, 24, endpoint=False), 0.99])
"""Damping ratios to check, as shares of the highest one that a shaper supports [-]."""
_DECLARED = (
    ("duration_periods", 0.0, 1e6, "a number from 0 to 1e6"),
    ("zeta_max", 1e-6, 1.0, "a number from 1e-6 to 1"),
    ("peak", 1.0, 1e6, "a number from 1 to 1e6"),
)
_APART = 1.7
"""Ratio of a mode's frequency to that of the next lower one, in checks of a FIR filter."""


def shaper_of(
    function: Callable[[float, float], Impulses],
    *,
    name: str = "",
    description: str = "",
    zeta_max: float = 1.0,
) -> Shaper:
    """Create a shaper from your own function, and determine its duration and peak by trials.

    Args:
        function: (f_d [Hz], ζ [-]) -> impulses of one mode. It is called at every tick and in several threads, so it
            must be fast, and always return the same result for the same mode. Its times must be proportional to
            1/f_d; for times that are not, use a `FirShaper`.
        name: Name of the shaper; "" for the function's name.
        description: Description of the shaper; "" for the first line of the function's docstring.
        zeta_max: Damping ratios must stay below this [-], above 0 and at most 1.

    Raises:
        DesignError: zeta_max is out of range.
        ShaperFailureError: The function raises an exception, or does not return impulses, for a mode of 0.1 to 200 Hz
            and a damping ratio below zeta_max.
    """
    if not 0.0 < zeta_max <= 1.0:
        raise DesignError("zeta_max", zeta_max, "above 0 and at most 1")
    called = name or getattr(function, "__name__", "own")
    lines = str(function.__doc__ or "").strip().splitlines()
    what = description or (lines[0] if lines else "a shaper of your own")
    trial = Shaper(called, what, function, np.inf, zeta_max, np.inf)
    duration, peak = _tried(trial)
    return Shaper(called, what, function, duration, zeta_max, peak if peak > 1.0 + ROUNDING else 1.0)


def check_shaper(shaper: Shaper | FirShaper) -> None:
    """Try a shaper with modes of 0.1 to 200 Hz, and damping ratios up to its highest one.

    Raises:
        DesignError: Its declaration is invalid.
        ShaperFailureError: Its function raises an exception, or returns weights whose sum is not 1 or that violate
            the declaration.
    """
    if isinstance(shaper, Shaper):
        for field, low, high, limit in _DECLARED:
            value = getattr(shaper, field)
            if not (isinstance(value, int | float) and low <= value <= high):
                raise DesignError(field, value, limit)
        _tried(shaper)
        return
    ratios = _APART ** np.arange(shaper.modes)
    for f_d in _F_D:
        for share in _SHARES:
            modes = f_d * ratios, np.full(shaper.modes, share)
            try:
                shaper.weights(*modes)
            except FAILURES as error:
                raise ShaperFailureError(shaper.name, failure(error, *modes)) from error


def _tried(shaper: Shaper) -> tuple[float, float]:
    """Return the longest duration in damped periods, and the largest sum of magnitudes.

    Raises:
        ShaperFailureError: The function fails, or violates the shaper's declaration.
    """
    longest, most = 0.0, 0.0
    for f_d in _F_D.tolist():
        for zeta in (shaper.zeta_max * _SHARES).tolist():
            try:
                impulses = shaper.impulses(f_d, zeta)
            except FAILURES as error:
                why = failure(error, np.array([f_d]), np.array([zeta]))
                raise ShaperFailureError(shaper.name, why) from error
            longest = max(longest, impulses.duration * f_d)
            most = max(most, float(np.abs(impulses.A).sum()))
    for what, found, declared in (
        ("duration_periods", longest, shaper.duration_periods),
        ("peak", most, shaper.peak),
    ):
        if found > declared * (1.0 + ROUNDING):
            raise ShaperFailureError(
                shaper.name, f"has a {what} of {found:g}, more than the declared {declared:g}"
            )
    return longest, most

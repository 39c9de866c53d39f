"""Create shapers from the user's functions, and check them before anything moves."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.catalogue import SHAPERS
from tvist_shaping.errors import DesignError, ShaperFailureError
from tvist_shaping.failures import FAILURES, ROUNDING, failure
from tvist_shaping.fir_shaper import FirShaper
from tvist_shaping.impulse_train import Impulses
from tvist_shaping.shaper import Shaper

TRIED_F_D = (0.1, 200.0)
"""Damped frequencies with which a shaper is tried [Hz]: all that a client may send to a robot."""
_USUAL = (10.0, 0.1)  # mode that is tried first: damped frequency [Hz], damping ratio [-]
_F_D = np.geomspace(*TRIED_F_D, 23)
_SHARES = np.array([*np.linspace(0.0, 1.0, 24, endpoint=False), 0.99])
"""Damping ratios to try, as shares of the shaper's zeta_max [-]."""
_DECLARED = (
    ("duration_periods", 0.0, 1e6, "a number from 0 to 1e6"),
    ("zeta_max", 1e-6, 1.0, "a number from 1e-6 to 1"),
    ("peak", 1.0, 1e6, "a number from 1 to 1e6"),
)
_APART = 1.7  # ratio of a mode's frequency to that of the next lower one, in checks of a FIR filter


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
            must be fast, and always return the same result for the same mode.
        name: Name of the shaper; "" for the function's name.
        description: Description of the shaper; "" for the first line of the function's docstring.
        zeta_max: Damping ratios must stay below this [-], above 0 and at most 1.

    Raises:
        DesignError: zeta_max is out of range.
        ShaperFailureError: The function raises an exception, or does not return impulses, for every mode of 0.1 to
            200 Hz and a damping ratio below zeta_max. A robot demands that it works for all modes of its arm.
    """
    if not 0.0 < zeta_max <= 1.0:
        raise DesignError("zeta_max", zeta_max, "above 0 and at most 1")
    known = next((one for one in SHAPERS.values() if one.function is function), None)
    called = name or getattr(function, "__name__", "own" if known is None else known.name)
    lines = str(function.__doc__ or "").strip().splitlines()
    what = lines[0] if lines else "a shaper of your own"
    what = description or (what if known is None else known.description)
    duration, peak, _ = _tried(Shaper(called, what, function, np.inf, zeta_max, np.inf))
    return Shaper(called, what, function, duration, zeta_max, peak if peak > 1.0 + ROUNDING else 1.0)


def check_shaper(shaper: Shaper | FirShaper) -> None:
    """Try a shaper with modes of 0.1 to 200 Hz, and damping ratios up to its highest one.

    Raises:
        DesignError: Its declaration is invalid.
        ShaperFailureError: Its function fails for all of them, or violates the declaration for one.
    """
    if isinstance(shaper, Shaper):
        for field, low, high, limit in _DECLARED:
            value = getattr(shaper, field)
            if not (isinstance(value, int | float) and low <= value <= high):
                raise DesignError(field, value, limit)
    _tried(shaper)


def check_range(
    shaper: Shaper | FirShaper, f_d: tuple[float, float], zeta: tuple[float, float], whose: str
) -> None:
    """Raise ShaperFailureError unless a shaper works for all f_d [Hz] and ζ [-] of an arm, named by `whose`."""
    for one in np.geomspace(*f_d, 25).tolist():
        for other in np.linspace(*zeta, 10).tolist():
            try:
                _evaluated(shaper, one, other)
            except ShaperFailureError as error:
                limits = f"{f_d[0]:.3g} to {f_d[1]:.3g} Hz with ζ = {zeta[0]:.2g} to {zeta[1]:.2g}"
                raise ShaperFailureError(
                    shaper.name,
                    f"{error.why}; it must support the modes of {whose}, {limits}: extend what it is defined over, or "
                    "clip f_d and zeta to that",
                ) from error


def longest(shaper: Shaper, f_d_min: float) -> float:
    """Return the longest duration of one mode [s] over all modes from f_d_min [Hz] up that the shaper supports.

    It is shorter than `duration_periods` suggests if the times are not proportional to 1/f_d, as those from a table.
    """
    undeclared = replace(shaper, duration_periods=np.inf, peak=np.inf)
    return _tried(undeclared, np.geomspace(f_d_min, max(f_d_min, TRIED_F_D[1]), _F_D.size))[2]


def _tried(shaper: Shaper | FirShaper, tried: Floats = _F_D) -> tuple[float, float, float]:
    """Return the longest duration in damped periods, the largest sum of magnitudes, and the longest duration [s].

    Each is the largest value over the tried modes; modes for which the function fails are left out.
    """
    zeta_max = shaper.zeta_max if isinstance(shaper, Shaper) else 1.0
    undeclared = shaper if isinstance(shaper, Shaper) else replace(shaper, peak=1e300)
    modes = [(f_d, zeta) for f_d in tried.tolist() for zeta in (zeta_max * _SHARES).tolist()]
    found = []
    first = None
    for f_d, zeta in ((max(_USUAL[0], tried[0]), min(_USUAL[1], 0.5 * zeta_max)), *modes):
        try:
            impulses = _evaluated(undeclared, f_d, zeta)
        except ShaperFailureError as error:
            first = first or error
            continue
        found.append((impulses.duration * f_d, float(np.abs(impulses.A).sum()), impulses.duration))
    if not found:
        assert first is not None
        raise first
    periods, most, seconds = map(max, zip(*found, strict=True))
    declared = {"peak": (most, shaper.peak)}
    if isinstance(shaper, Shaper):
        declared["duration_periods"] = (periods, shaper.duration_periods)
    for what, (value, limit) in declared.items():
        if value > limit * (1.0 + ROUNDING):
            raise ShaperFailureError(
                shaper.name,
                f"has a {what} of {value:g}, more than the declared {limit:g}: give {what}={value:.9g} to "
                f"{type(shaper).__name__}, or change the function",
            )
    return periods, most, seconds


def _evaluated(shaper: Shaper | FirShaper, f_d: float, zeta: float) -> Impulses:
    """Return the impulses for a mode; a FIR filter of several modes gets the others at higher frequencies."""
    count = 1 if isinstance(shaper, Shaper) else shaper.modes
    modes = np.array([f_d * _APART**mode for mode in range(count)]), np.full(count, zeta)
    try:
        if isinstance(shaper, Shaper):
            return shaper.impulses(f_d, zeta)
        weights = shaper.weights(*modes)
        return Impulses(weights, shaper.period * np.arange(float(weights.size)))
    except FAILURES as error:
        raise ShaperFailureError(shaper.name, failure(error, *modes)) from error

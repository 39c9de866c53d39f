"""Shapers with parameters, and shapers from the user's own impulses."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tvist_shaping.amplitudes import modified, ripple
from tvist_shaping.errors import DesignError
from tvist_shaping.exact import HumpShaper
from tvist_shaping.impulse_train import Impulses, check_mode
from tvist_shaping.impulses import Train, V
from tvist_shaping.sensitivity import residual
from tvist_shaping.shaper import Shaper
from tvist_shaping.specified import specified

ROUNDING = 1e-6  # share of V by which rounding may let a residual exceed it [-]


def mzv_of(n: int = 3, t: float = 0.75, *, name: str = "", description: str = "") -> Shaper:
    """Create a modified zero-vibration shaper MZV(n, t): n equally spaced impulses in t periods.

    Args:
        n: Number of impulses, 3 to 30.
        t: Duration in damped periods [-], less than (n-1)/2, and not so short that an amplitude is negative.
        name: Name of the shaper; "" for `mzv(n,t)`.
        description: Description of the shaper; "" for a generated one.

    Raises:
        DesignError: n or t is out of range, or an amplitude would be negative.
    """
    train = Train(modified(n, t), np.linspace(0.0, t, n))
    what = description or f"modified zero vibration, {n} impulses in {t:g} periods"
    return Shaper(name or f"mzv({n},{t:g})", what, train, t)


def ei_of(
    humps: int = 1, V: float = V, *, exact: bool = False, name: str = "", description: str = ""
) -> Shaper:
    """Create an extra-insensitive shaper with a given number and height of humps.

    Args:
        humps: Number of humps, 1 to 10; the shaper lasts (humps + 1)/2 periods.
        V: Height of the humps, which is the permitted residual vibration [-], 1e-4 to 0.5.
        exact: Whether the humps have that height with damping too, see `tvist_shaping.exact`. The range of damping is
            then limited, more so with higher and more humps. Otherwise the humps are lower with damping.
        name: Name of the shaper; "" for `ei(humps,V)` or `ei_exact(humps,V)`.
        description: Description of the shaper; "" for a generated one.

    Raises:
        DesignError: An argument is out of range.
    """
    if humps < 1:
        raise DesignError("humps", humps, "1 to 10")
    a = ripple(humps, V)
    what = (
        description or f"extra-insensitive, {humps} hump(s) of {100.0 * V:g} %{' exactly' if exact else ''}"
    )
    if exact:
        made = HumpShaper(humps, V)
        return Shaper(name or f"ei_exact({humps},{V:g})", what, made, made.duration_periods, made.zeta_max)
    duration = (humps + 1) / 2.0
    train = Train(a, np.linspace(0.0, duration, humps + 2))
    return Shaper(name or f"ei({humps},{V:g})", what, train, duration)


def si_of(
    low: float = 0.75, high: float = 1.25, V: float = V, *, name: str = "", description: str = ""
) -> Shaper:
    """Create a specified-insensitivity shaper: the shortest positive train that leaves at most V from low to high.

    It is designed without damping (`tvist_shaping.specified`); damping is then applied as for the other shapers. In
    narrow bands this leaves less than V at any damping, but in very wide bands slightly more at some damping ratios:
    the shaper's range of damping ends where that begins.

    Args:
        low: Lowest ratio of true to assumed frequency [-], above 0, at most 1.
        high: Highest ratio of true to assumed frequency [-], at least 1.
        V: Residual vibration permitted between them [-], 1e-4 to 0.5.
        name: Name of the shaper; "" for `si(low,high,V)`.
        description: Description of the shaper; "" for a generated one.

    Raises:
        DesignError: An argument is out of range, or the band is too wide for 12 impulses.
    """
    if not 0.0 < low <= 1.0:
        raise DesignError("low", low, "above 0 and at most 1, the assumed frequency")
    if not 1.0 <= high < math.inf:
        raise DesignError("high", high, "at least 1, the assumed frequency")
    train = Train(*specified(low, high, V))
    zeta_max, f = 0.0, np.linspace(low, high, 301)
    for zeta in np.linspace(0.0, 0.99, 100):
        if residual(f, zeta, train(1.0, zeta)).max() > V * (1.0 + ROUNDING):
            break
        zeta_max = float(zeta)
    if zeta_max <= 0.985:
        train = replace(train, zeta_max=zeta_max, instead="more than V is left: take a higher V or ei_of")
    what = description or f"specified insensitivity: at most {100.0 * V:g} % from {low:g} to {high:g}"
    return Shaper(name or f"si({low:g},{high:g},{V:g})", what, train, train.duration_periods, train.zeta_max)


def custom(
    name: str,
    A: npt.ArrayLike,
    tau: npt.ArrayLike,
    f_d: float = 1.0,
    *,
    zeta_max: float = 1.0,
    description: str = "",
) -> Shaper:
    """Create a shaper from your own impulses.

    For a mode of another frequency than f_d, times are scaled; the amplitudes are the same at any damping.

    Args:
        name: Name of the shaper.
        A: Amplitudes [-], shape (N,), sum 1; negative ones exceed the reference's limits.
        tau: Times [s], shape (N,), ascending from 0.
        f_d: Damped frequency of the mode that they are designed for [Hz]. With 1, tau is in damped periods.
        zeta_max: Damping ratios must stay below this [-], at most 1.
        description: Description of the shaper; "" for a generated one.

    Raises:
        ImpulseError: A and tau are not an impulse train; the message says why.
        ShaperRangeError: f_d is out of range.
        DesignError: zeta_max is out of range.
    """
    check_mode(f_d, 0.0)
    if not 0.0 < zeta_max <= 1.0:
        raise DesignError("zeta_max", zeta_max, "above 0 and at most 1")
    train = Impulses(np.asarray(A, dtype=float), np.asarray(tau, dtype=float) * f_d)

    def function(f_d: float, zeta: float) -> Impulses:
        check_mode(f_d, zeta, zeta_max)
        return Impulses(train.A, train.tau / f_d)

    what = description or "impulses of your own"
    peak = max(float(np.abs(train.A).sum()), 1.0)
    return Shaper(name, what, function, train.duration, zeta_max, peak)

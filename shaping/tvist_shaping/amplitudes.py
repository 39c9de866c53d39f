"""Amplitudes of undamped shapers with equally spaced impulses."""

import math

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import DesignError


def ripple(humps: int, V: float) -> Floats:
    """Amplitudes of the extra-insensitive shapers: impulses half a period apart, humps of equal height V.

    Without damping, the residual vibration of N = humps + 2 impulses is a polynomial of degree N - 1 in cos(π
    f/2f_d). The polynomial that stays within V over the widest band is Chebyshev's (as in Dolph's antenna arrays,
    Proc. IRE 34, 1946):

        V(f) = V |T_{N-1}(x₀ cos(π f/2f_d))|,    T_{N-1}(x₀) = 1/V.

    For one hump the amplitudes are ((1+V)/4, (1-V)/2, (1+V)/4). For two and three humps they are the shapers of
    Singhose, Porter, Tuttle and Singer (J. Dyn. Sys. Meas. Control 119, 1997); without humps they are those of zv.
    """
    if not 0 <= humps <= 10:
        raise DesignError("humps", humps, "0 to 10")
    if not 1e-4 <= V <= 0.5:
        raise DesignError("V", V, "0.0001 to 0.5")
    N = humps + 2
    places = np.arange(N)
    x = widening(humps, V) * np.cos(math.pi * places / N)
    inside = np.cos((N - 1) * np.arccos(np.clip(x, -1.0, 1.0)))
    outside = np.sign(x) ** (N - 1) * np.cosh((N - 1) * np.arccosh(np.maximum(np.abs(x), 1.0)))
    spectrum = V * np.where(np.abs(x) <= 1.0, inside, outside)
    a = np.cos(2.0 * math.pi * np.outer(places - (N - 1) / 2.0, places) / N) @ spectrum
    return np.asarray(a / a.sum())


def widening(humps: int, V: float) -> float:
    """Return x₀ of `ripple`: the band ends where x₀ cos(π f/2f_d) = 1."""
    return math.cosh(math.acosh(1.0 / V) / (humps + 1))


def modified(n: int, t: float) -> Floats:
    """Amplitudes of the modified zero-vibration shapers MZV(n, t) (known from Klipper).

    n equally spaced impulses in t periods, with n - 1 zeros of the residual at 1 + i/τ times the design frequency, τ
    = t (n-2)/(n-2t-1) and i = 0 … n-2: the first zero is at the design frequency, the others are above it. In w =
    exp(2πi f t/(n-1)f_d) the residual is a polynomial whose zeros are equally spaced in angle, from 2πt/(n-1) round
    to its mirror image.
    """
    if not 3 <= n <= 30:
        raise DesignError("n", n, "3 to 30 impulses")
    highest = (n - 1) / 2.0
    if not 1e-6 <= t <= highest - 1e-6:
        raise DesignError("t", t, f"above 0 and less than (n - 1)/2 = {highest:g} periods")
    first = 2.0 * math.pi * t / (n - 1)
    a = np.real(np.poly(np.exp(1j * np.linspace(first, 2.0 * math.pi - first, n - 1))))
    a = a / a.sum()
    if a.min() < -1e-9:
        raise DesignError("t", t, f"longer, for {n} impulses: amplitudes would be negative ({a.min():.3g})")
    return np.asarray(np.maximum(a, 0.0) / np.maximum(a, 0.0).sum())

"""Extra-insensitive shapers that are exact with damping: humps of height V, and V at f_d if a hump is there.

`ripple` computes the undamped shapers. With their amplitudes multiplied by K^j for damping, they leave less
than V, but in a band that is narrower than possible. Here the conditions are solved with damping.
With N = humps + 2 impulses, T_d = 1, s = 2π(ζ/√(1-ζ²) + i), c = Re s, and r the ratio of true to design
frequency,

    E(r) = Σ A_j exp(r (s τ_j - c τ_N))    (|E| is the residual of `sensitivity`)

has N - 1 zeros E = 0 and between them N - 2 humps |E| = V, d|E|/dr = 0; the middle zero or hump of them is at
r = 1. Together with ΣA = 1 there are as many equations as unknowns A_j, τ_j and r. They are solved from zero
damping upwards.

As damping increases, the highest zero moves to infinity; a shaper's range ends when this zero is at 1.8 times the
design frequency. (Cubic fits in ζ for two and three humps have been published and are used in printer firmware, valid
to 0.3 and 0.2; their times are in *undamped* periods.)
"""

import math

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.amplitudes import ripple, widening
from tvist_shaping.errors import ConvergenceError
from tvist_shaping.impulses import V
from tvist_shaping.newton import solve
from tvist_shaping.tabulated import Tabulated

HIGHEST_ZERO = 1.8  # largest permitted ratio of the highest zero to the design frequency [-]


class HumpShaper(Tabulated):
    """Shaper with humps of height V, for damping ratios below `zeta_max`; None for the highest possible."""

    def __init__(self, humps: int, V: float, instead: str = "", zeta_max: float | None = None) -> None:
        self.V, self.N = V, humps + 2
        degree = humps + 1
        # Zeros and humps of Chebyshev's polynomial, which are those of the undamped shaper.
        x = np.cos(np.arange(1, 2 * degree) * math.pi / (2 * degree)) / widening(humps, V)
        features = 2.0 / math.pi * np.arccos(x)
        start = np.concatenate([ripple(humps, V), np.arange(1, self.N) / 2.0, np.delete(features, humps)])
        instead = f"take {instead or f'ei_of({humps}, {V:g})'}, which leaves less"
        if zeta_max is None:
            super().__init__(start, self._limit(start), instead)
        else:
            super().__init__(start, zeta_max, instead, degree / 2.0)

    def follow(self, zeta: float, near: Floats) -> tuple[Floats, Floats, Floats]:
        """Solve at ζ; see `Tabulated.follow`."""
        x = solve(lambda points: self._equations(zeta, points), near)
        A, tau, _, _ = self._split(x[None])
        return x, A[0], tau[0]

    def _limit(self, x: Floats) -> float:
        """Return the highest damping ratio, to a hundredth [-]; x has the unknowns without damping."""
        zeta = 0.0
        while zeta < 0.9:
            try:
                x, A, tau = self.follow(zeta + 0.01, x)
            except ConvergenceError:
                break
            if x[-1] > HIGHEST_ZERO or A.min() <= 0.0 or np.diff(tau).min() <= 0.0:
                break
            zeta += 0.01
        return round(zeta, 2)

    def _split(self, points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Split the unknowns into amplitudes, times, zeros and humps, shape (M, …) each."""
        N, one = self.N, np.ones((len(points), 1))
        A, tau = points[:, :N], np.hstack([0.0 * one, points[:, N : 2 * N - 1]])
        below, above = np.split(points[:, 2 * N - 1 :], 2, axis=1)
        features = np.hstack([below, one, above])
        return A, tau, features[:, 0::2], features[:, 1::2]

    def _equations(self, zeta: float, points: Floats) -> Floats:
        A, tau, zeros, humps = self._split(points)
        c = 2.0 * math.pi * zeta / math.sqrt(1.0 - zeta * zeta)
        exponents = ((c + 2j * math.pi) * tau - c * tau[:, -1:])[:, None]
        nothing = (A[:, None] * np.exp(zeros[:, :, None] * exponents)).sum(axis=-1)
        waves = A[:, None] * np.exp(humps[:, :, None] * exponents)
        E, slope = waves.sum(axis=-1), (waves * exponents).sum(axis=-1)
        return np.hstack(
            [
                A.sum(axis=1, keepdims=True) - 1.0,
                nothing.real,
                nothing.imag,
                np.abs(E) ** 2 / self.V - self.V,
                (E.conj() * slope).real / self.V,
            ]
        )


ei_exact = HumpShaper(1, V, "ei", 0.52)
"""One hump of height V = 5 % with any damping ratio below 0.52; equal to `ei` without damping."""
ei2_exact = HumpShaper(2, V, "ei2", 0.32)
"""Two humps of height V = 5 % with any damping ratio below 0.32; equal to `ei2` without damping."""
ei3_exact = HumpShaper(3, V, "ei3", 0.2)
"""Three humps of height V = 5 % with any damping ratio below 0.2; equal to `ei3` without damping."""

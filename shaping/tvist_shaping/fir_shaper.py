"""A shaper that is a FIR filter: weights of the newest samples, as a function of the modes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.errors import DesignError, ShaperFailureError
from tvist_shaping.failures import ROUNDING
from tvist_shaping.impulses import Impulses
from tvist_shaping.steady import Design

MAX_TAPS = 500
"""Taps of the longest filter: one second at 500 Hz."""


@dataclass(frozen=True, slots=True)
class FirShaper:
    """A shaper of your own that is a FIR filter.

    A filter made of it asks for new taps every fourth tick and averages them over 0.4 s, so that they move without
    kinks while the arm moves. Taps that are always the same are a function that does not look at the modes.

    Attributes:
        name: What it is called on the wire and in tables.
        description: What it does, in one line.
        function: (f_d [Hz], ζ [-]), each of shape (modes,), the lowest mode first -> weights h_n of the samples of n
            ticks ago [-], shape (N,) with N at most `taps`, sum 1.
        taps: Largest number of taps, 1 to 500.
        modes: Number of modes passed to the function, 1 to 8.
        peak: Σ|h_n| at the most, by which it may exceed its reference's velocity and acceleration; 1 where no tap is
            negative [-].
        period: Tick [s].

    Raises:
        DesignError: A number is out of range.
    """

    name: str
    description: str
    function: Callable[[Floats, Floats], npt.ArrayLike]
    taps: int
    modes: int = 1
    peak: float = 1.0
    period: float = 0.002

    def __post_init__(self) -> None:
        if not (isinstance(self.taps, int) and 1 <= self.taps <= MAX_TAPS):
            raise DesignError("taps", self.taps, f"a whole number from 1 to {MAX_TAPS}")
        if not (isinstance(self.modes, int) and 1 <= self.modes <= 8):
            raise DesignError("modes", self.modes, "a whole number from 1 to 8")
        if not 1.0 <= self.peak < np.inf:
            raise DesignError("peak", self.peak, "finite and at least 1")
        if not 0.0 < self.period < np.inf:
            raise DesignError("period", self.period, "a finite number of seconds above 0")

    def weights(self, f_d: Floats, zeta: Floats) -> Floats:
        """What `function` gives, checked and filled up with zeros, shape (taps,).

        Args:
            f_d: Damped frequencies [Hz], shape (modes,).
            zeta: Damping ratios [-], shape (modes,).

        Raises:
            Exception: Whatever the function raises.
            ShaperFailureError: The function's taps do not sum to 1, or do not match the declaration.
        """
        given = np.array(self.function(f_d.copy(), zeta.copy()), dtype=float)
        if given.ndim != 1 or not 1 <= given.size <= self.taps:
            raise ShaperFailureError(
                self.name, f"returns taps of shape {given.shape}, but must return 1 to {self.taps}"
            )
        if not np.isfinite(given).all():
            raise ShaperFailureError(self.name, "returns taps that are not finite")
        if abs(given.sum() - 1.0) >= 1e-9:
            raise ShaperFailureError(
                self.name, f"returns taps that sum to {float(given.sum())!r}, but must sum to 1 within 1e-9"
            )
        if (most := float(np.abs(given).sum())) > self.peak * (1.0 + ROUNDING):
            raise ShaperFailureError(
                self.name,
                f"returns taps whose magnitudes sum to {most:g}, more than its peak of {self.peak:g}",
            )
        return np.pad(given, (0, self.taps - given.size))

    def impulses(self, f_d: float, zeta: float) -> Impulses:
        """The taps as impulses, where every mode is the same one: what the other figures of a shaper are made from.

        Args:
            f_d: Damped frequency of the mode [Hz].
            zeta: Damping ratio of the mode [-].

        Raises:
            Exception: See `weights`.
        """
        weights = self.weights(np.full(self.modes, f_d), np.full(self.modes, zeta))
        last = int(np.flatnonzero(weights)[-1]) + 1
        return Impulses(weights[:last], self.period * np.arange(last, dtype=np.float64))

    def design(self) -> Design:
        """This shaper as a design for `SteadyFilter`."""
        return _Weights(self)


class _Weights(Design):
    """A `FirShaper`'s taps, which depend on nothing but the modes."""

    def __init__(self, shaper: FirShaper) -> None:
        self._shaper = shaper
        self.name, self.modes, self.taps = shaper.name, shaper.modes, shaper.taps
        self.period, self.peak = shaper.period, shaper.peak

    def __repr__(self) -> str:
        return f"{self.name!r}"

    def copy(self) -> "_Weights":
        """Itself: it remembers nothing."""
        return self

    def fork(self) -> Self:
        """Itself: it remembers nothing."""
        return self

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Taps for these modes; see `Design.start`."""
        taps[:] = self._shaper.weights(f_d, zeta)
        return True

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:  # noqa: ARG002
        """Taps for these modes; see `Design.go_on`."""
        return self.start(f_d, zeta, taps)

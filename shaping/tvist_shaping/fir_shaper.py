"""User-defined FIR filters: weights of the newest samples as a function of the modes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.errors import DesignError, ShaperFailureError, check_positive
from tvist_shaping.failures import ROUNDING
from tvist_shaping.impulse_train import Impulses
from tvist_shaping.steady import Design

MAX_TAPS = 500  # largest number of taps of a filter: one second at 500 Hz


@dataclass(frozen=True, slots=True)
class FirShaper:
    """A user-defined shaper that is a FIR filter.

    Its filter computes new taps every fourth tick and averages them over 0.4 s, so that they change smoothly while the
    arm moves. For constant taps, use a function that ignores the modes.

    Attributes:
        name: Name on the wire and in tables.
        description: Description in one line.
        function: (f_d [Hz], ζ [-]), each of shape (modes,), the lowest mode first -> weights h_n of the samples n ticks
            ago [-], shape (N,) with N at most `taps`, sum 1.
        taps: Largest number of taps, 1 to 500.
        modes: Number of modes passed to the function, 1 to 8.
        peak: Upper bound of Σ|h_n|, the factor by which the shaped velocity and acceleration may exceed the
            reference's; 1 if no tap is negative [-].
        period: Tick [s].

    Raises:
        DesignError: A value is out of range.
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
        check_positive(DesignError, "seconds", period=self.period)

    def weights(self, f_d: Floats, zeta: Floats) -> Floats:
        """Call `function`, check its result and pad it with zeros, shape (taps,).

        Args:
            f_d: Damped frequencies [Hz], shape (modes,).
            zeta: Damping ratios [-], shape (modes,).

        Raises:
            Exception: Any exception that the function raises.
            ShaperFailureError: The taps do not sum to 1, or do not match the declaration.
        """
        given = np.array(self.function(f_d.copy(), zeta.copy()), dtype=float)
        if given.ndim != 1 or not 1 <= given.size <= self.taps:
            why = f"returns taps of shape {given.shape}: must be 1 to {self.taps} taps"
            more = given.ndim == 1 and self.taps < given.size <= MAX_TAPS
            raise ShaperFailureError(self.name, f"{why} (give FirShaper taps={given.size})" if more else why)
        if not np.isfinite(given).all():
            raise ShaperFailureError(self.name, "returns taps that are not finite")
        if abs(given.sum() - 1.0) >= 1e-9:
            raise ShaperFailureError(
                self.name,
                f"returns taps that sum to {float(given.sum())!r}: must be 1 within 1e-9 "
                "(divide them by their sum)",
            )
        if (most := float(np.abs(given).sum())) > self.peak * (1.0 + ROUNDING):
            raise ShaperFailureError(
                self.name,
                f"returns taps whose magnitudes sum to {most:g}: must be at most its peak of {self.peak:g} "
                f"(give FirShaper peak={most:g})",
            )
        return np.pad(given, (0, self.taps - given.size))

    def impulses(self, f_d: float, zeta: float) -> Impulses:
        """Return the taps as impulses if all modes are equal, to compute the shaper's other properties.

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
        """Convert this shaper to a design for `SteadyFilter`."""
        return _Weights(self)


class _Weights(Design):
    """Design with the taps of a `FirShaper`, which depend only on the modes."""

    def __init__(self, shaper: FirShaper) -> None:
        self._shaper = shaper
        self.name, self.modes, self.taps = shaper.name, shaper.modes, shaper.taps
        self.period, self.peak = shaper.period, shaper.peak

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for these modes."""
        taps[:] = self._shaper.weights(f_d, zeta)
        return True

    def mean_delay_of(self, f_d: Floats, zeta: Floats) -> float:
        """See `Filter.mean_delay_of`."""
        return float(self._shaper.weights(f_d, zeta) @ np.arange(self.taps)) * self.period

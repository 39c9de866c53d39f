"""Shapers as a filter uses them: impulses as a function of the mode, and properties known in advance."""

from collections.abc import Callable
from dataclasses import dataclass

from tvist_shaping.errors import ShaperFailureError
from tvist_shaping.impulse_train import Impulses
from tvist_shaping.sensitivity import band


@dataclass(frozen=True, slots=True)
class Shaper:
    """A shaper as a filter uses it; you can create your own in the same way.

    Attributes:
        name: Name on the wire and in tables.
        description: Description in one line.
        function: (f_d [Hz], ζ [-]) -> impulses of one mode.
        duration_periods: Largest time of the last impulse over all ζ, in damped periods [-].
        zeta_max: Damping ratios must stay below this [-].
        peak: Σ|A_j|, the largest factor by which the shaped velocity and acceleration may exceed the reference's while
            f_d and ζ are constant; 1 for positive impulses [-].
    """

    name: str
    description: str
    function: Callable[[float, float], Impulses]
    duration_periods: float
    zeta_max: float = 1.0
    peak: float = 1.0

    def impulses(self, f_d: float, zeta: float) -> Impulses:
        """Call `function`, and check that it returns impulses, since it may be the user's.

        Args:
            f_d: Damped frequency of the mode [Hz].
            zeta: Damping ratio of the mode [-].

        Raises:
            Exception: Any exception that the function raises.
            ShaperFailureError: The function returns something else.
        """
        impulses = self.function(f_d, zeta)
        if not isinstance(impulses, Impulses):
            kind = type(impulses).__name__
            raise ShaperFailureError(
                self.name, f"returns {kind} instead of Impulses(A, tau) of tvist_shaping"
            )
        return impulses

    def band(self, V: float = 0.05, zeta: float = 0.0) -> tuple[float, float]:
        """Return the lowest and highest ratio of true to assumed frequency at which at most V is left [-].

        Both are NaN if even the ratio 1 leaves more; see `sensitivity.band`.

        Args:
            V: Permitted residual vibration [-], 0 < V < 1.
            zeta: Damping ratio, both assumed and true [-].

        Raises:
            ShapingError: V or ζ is out of range.
        """
        return band(self.function(1.0, zeta), 1.0, zeta, V)

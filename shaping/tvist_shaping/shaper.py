"""What a shaper is to the filter: impulses as a function of the mode, and what must be known of them beforehand."""

from collections.abc import Callable
from dataclasses import dataclass

from tvist_shaping.errors import ShaperFailureError
from tvist_shaping.impulses import Impulses
from tvist_shaping.sensitivity import band


@dataclass(frozen=True, slots=True)
class Shaper:
    """A shaper as the filter takes it; one of your own is made the same way.

    Attributes:
        name: What it is called on the wire and in tables.
        description: What it does, in one line.
        function: (f_d [Hz], ζ [-]) -> impulses of one mode.
        duration_periods: Time of the last impulse in damped periods, the longest over every ζ [-].
        zeta_max: Damping ratios must stay below this [-].
        peak: Σ|A_j|, the most by which it may exceed its reference's velocity and acceleration where f_d and ζ do
            not change; 1 for positive impulses [-].
    """

    name: str
    description: str
    function: Callable[[float, float], Impulses]
    duration_periods: float
    zeta_max: float = 1.0
    peak: float = 1.0

    def impulses(self, f_d: float, zeta: float) -> Impulses:
        """What `function` gives, checked to be impulses: the function may be anybody's.

        Args:
            f_d: Damped frequency of the mode [Hz].
            zeta: Damping ratio of the mode [-].

        Raises:
            Exception: Whatever the function raises.
            ShaperFailureError: It gives something else.
        """
        impulses = self.function(f_d, zeta)
        if not isinstance(impulses, Impulses):
            raise ShaperFailureError(self.name, f"returns {type(impulses).__name__} instead of Impulses")
        return impulses

    def band(self, V: float = 0.05, zeta: float = 0.0) -> tuple[float, float]:
        """How wrong the frequency may be: the span of true over assumed frequency in which at most V is left.

        Args:
            V: Residual vibration allowed [-], 0 < V < 1.
            zeta: Damping ratio, assumed and true [-].

        Returns:
            Lowest and highest ratio [-], as `sensitivity.band` has them: NaN where even 1 is not in it.

        Raises:
            ShapingError: V or ζ is out of range.
        """
        return band(self.function(1.0, zeta), 1.0, zeta, V)

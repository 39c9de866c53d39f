"""The shapers by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType

from tvist_shaping import impulses
from tvist_shaping.errors import UnknownShaperError
from tvist_shaping.impulses import Impulses


@dataclass(frozen=True, slots=True)
class Shaper:
    """A shaper as the filter takes it; one of your own is made the same way.

    Attributes:
        name: What it is called on the wire and in tables.
        description: What it does, in one line.
        function: (f_d [Hz], ζ [-]) -> impulses of one mode.
        duration_periods: Time of the last impulse in damped periods, whatever f_d and ζ [-].
        zeta_max: Damping ratios must stay below this [-].
    """

    name: str
    description: str
    function: Callable[[float, float], Impulses]
    duration_periods: float
    zeta_max: float = 1.0


SHAPERS: Mapping[str, Shaper] = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            Shaper("none", "no shaping", impulses.none, 0.0),
            Shaper("zv", "zero vibration: the shortest, the paper's", impulses.zv, 0.5),
            Shaper("mzv", "modified zero vibration: a little longer, a little wider", impulses.mzv, 0.75),
            Shaper("zvd", "zero vibration and derivative: forgives 14 % of frequency", impulses.zvd, 1.0),
            Shaper("ei", "extra-insensitive: as long as zvd, forgives 20 %", impulses.ei, 1.0),
            Shaper("ei2", "two-hump extra-insensitive: forgives 36 %", impulses.ei2, 1.5),
            Shaper("ei3", "three-hump extra-insensitive: forgives 48 %", impulses.ei3, 2.0),
        )
    }
)
"""The catalogue, shortest first."""


def shaper(name: str) -> Shaper:
    """Look a shaper up by its name.

    Args:
        name: One of `SHAPERS`.

    Returns:
        The shaper.

    Raises:
        UnknownShaperError: There is none of that name; it lists those there are and the nearest.
    """
    try:
        return SHAPERS[name]
    except KeyError:
        near = get_close_matches(name, SHAPERS, n=1)
        raise UnknownShaperError(name, tuple(SHAPERS), near[0] if near else None) from None

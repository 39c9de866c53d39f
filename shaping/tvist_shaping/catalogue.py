"""Catalogue of shapers by name."""

from collections.abc import Mapping
from difflib import get_close_matches
from types import MappingProxyType

from tvist_shaping import exact, impulses, unity
from tvist_shaping.errors import UnknownShaperError
from tvist_shaping.impulses import Train
from tvist_shaping.shaper import Shaper
from tvist_shaping.tabulated import Tabulated


def _entry(name: str, description: str, of: Train | Tabulated, peak: float = 1.0) -> Shaper:
    return Shaper(name, description, of, of.duration_periods, of.zeta_max, peak)


_ENTRIES = (
    _entry("none", "no shaping", impulses.none),
    _entry("um_zv", "unity magnitude: shorter than zv, up to 3 times the acceleration", unity.um_zv, 3.0),
    _entry("zv", "zero vibration: the shortest that keeps the limits, the paper's", impulses.zv),
    _entry("mzv", "modified zero vibration: slightly longer and more robust than zv", impulses.mzv),
    _entry("um_zvd", "unity magnitude: shorter than zvd, up to 5 times the acceleration", unity.um_zvd, 5.0),
    _entry("zvd", "zero vibration and derivative: tolerates frequency errors of 14 %", impulses.zvd),
    _entry("ei", "extra-insensitive: as long as zvd, tolerates 20 %", impulses.ei),
    _entry("ei_exact", "ei with 5 % at f_d for any damping: more robust there", exact.ei_exact),
    _entry("si", "specified insensitivity: the shortest that tolerates 25 %", impulses.SI),
    _entry("zvdd", "zero vibration and two derivatives: tolerates 24 %", impulses.zvdd),
    _entry("ei2", "two-hump extra-insensitive: tolerates 36 %", impulses.ei2),
    _entry("ei2_exact", "ei2 with humps of 5 % for any damping", exact.ei2_exact),
    _entry("zvddd", "zero vibration and three derivatives: tolerates 31 %", impulses.zvddd),
    _entry("ei3", "three-hump extra-insensitive: tolerates 48 %", impulses.ei3),
    _entry("ei3_exact", "ei3 with humps of 5 % for any damping", exact.ei3_exact),
)  # fmt: skip
SHAPERS: Mapping[str, Shaper] = MappingProxyType({entry.name: entry for entry in _ENTRIES})
"""All catalogued shapers by name, shortest first."""


def shaper(name: str) -> Shaper:
    """Return the shaper of a name.

    Args:
        name: One of `SHAPERS`.

    Raises:
        UnknownShaperError: There is no shaper of that name; the error lists all names and the most similar one.
    """
    try:
        return SHAPERS[name]
    except KeyError:
        near = get_close_matches(name, SHAPERS, n=1)
        raise UnknownShaperError(name, tuple(SHAPERS), near[0] if near else None) from None

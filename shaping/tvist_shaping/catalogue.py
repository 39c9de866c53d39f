"""Catalogue of shapers by name."""

from collections.abc import Mapping
from difflib import get_close_matches
from types import MappingProxyType

from tvist_shaping import exact, impulses, unity
from tvist_shaping.errors import UnknownShaperError
from tvist_shaping.shaper import Shaper

SHAPERS: Mapping[str, Shaper] = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            Shaper("none", "no shaping", impulses.none, 0.0, train=impulses.NONE),
            Shaper(
                "um_zv",
                "unity magnitude: shorter than zv, up to 3 times the acceleration",
                unity.um_zv,
                unity.UM_ZV.duration_periods,
                unity.UM_ZV.zeta_max,
                peak=3.0,
            ),
            Shaper(
                "zv",
                "zero vibration: the shortest that keeps the limits, the paper's",
                impulses.zv,
                0.5,
                train=impulses.ZV,
            ),
            Shaper(
                "mzv",
                "modified zero vibration: slightly longer and more robust than zv",
                impulses.mzv,
                0.75,
                train=impulses.MZV,
            ),
            Shaper(
                "um_zvd",
                "unity magnitude: shorter than zvd, up to 5 times the acceleration",
                unity.um_zvd,
                unity.UM_ZVD.duration_periods,
                unity.UM_ZVD.zeta_max,
                peak=5.0,
            ),
            Shaper(
                "zvd",
                "zero vibration and derivative: tolerates frequency errors of 14 %",
                impulses.zvd,
                1.0,
                train=impulses.ZVD,
            ),
            Shaper(
                "ei", "extra-insensitive: as long as zvd, tolerates 20 %", impulses.ei, 1.0, train=impulses.EI
            ),
            Shaper(
                "ei_exact",
                "ei with 5 % at f_d for any damping: more robust there",
                exact.ei_exact,
                exact.EI.duration_periods,
                exact.EI.zeta_max,
            ),
            Shaper(
                "si",
                "specified insensitivity: the shortest that tolerates 25 %",
                impulses.SI.at,
                float(impulses.SI.periods[-1]),
                train=impulses.SI,
            ),
            Shaper(
                "zvdd",
                "zero vibration and two derivatives: tolerates 24 %",
                impulses.zvdd,
                1.5,
                train=impulses.ZVDD,
            ),
            Shaper(
                "ei2", "two-hump extra-insensitive: tolerates 36 %", impulses.ei2, 1.5, train=impulses.EI2
            ),
            Shaper(
                "ei2_exact",
                "ei2 with humps of 5 % for any damping",
                exact.ei2_exact,
                exact.EI2.duration_periods,
                exact.EI2.zeta_max,
            ),
            Shaper(
                "zvddd",
                "zero vibration and three derivatives: tolerates 31 %",
                impulses.zvddd,
                2.0,
                train=impulses.ZVDDD,
            ),
            Shaper(
                "ei3", "three-hump extra-insensitive: tolerates 48 %", impulses.ei3, 2.0, train=impulses.EI3
            ),
            Shaper(
                "ei3_exact",
                "ei3 with humps of 5 % for any damping",
                exact.ei3_exact,
                exact.EI3.duration_periods,
                exact.EI3.zeta_max,
            ),
        )
    }
)
"""The catalogue, shortest first."""


def shaper(name: str) -> Shaper:
    """Look up a shaper by its name.

    Args:
        name: One of `SHAPERS`.

    Returns:
        The shaper.

    Raises:
        UnknownShaperError: There is no shaper of that name; the error lists all names and the most similar one.
    """
    try:
        return SHAPERS[name]
    except KeyError:
        near = get_close_matches(name, SHAPERS, n=1)
        raise UnknownShaperError(name, tuple(SHAPERS), near[0] if near else None) from None

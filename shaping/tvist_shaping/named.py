"""Filters by name: every shaper of the catalogue, and the designs of constant mean delay."""

from collections.abc import Callable, Mapping
from difflib import get_close_matches
from types import MappingProxyType

from tvist_shaping.aimed import AimedFilter
from tvist_shaping.base import Filter
from tvist_shaping.catalogue import SHAPERS, shaper
from tvist_shaping.errors import UnknownShaperError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.filter import TvistFilter
from tvist_shaping.fir import FirDesign
from tvist_shaping.steady import Design, ShortDesign, SteadyFilter


def _auto() -> Design:
    return ShortDesign(0.030, wanted=FirDesign(residual=(0.035, 0.035, 0.06, 0.2)), name="auto")


def _short() -> Design:
    return ShortDesign(0.028, wanted=FirDesign(residual=(0.05, 0.05, 0.08, 0.2)), name="short")


def _auto_target() -> Design:
    return ShortDesign(0.026, wanted=FirDesign(residual=(0.035, 0.035, 0.06, 0.2)), name=AIMED)


AIMED = "auto-target"
DESIGNS: Mapping[str, Callable[[], Design]] = MappingProxyType(
    {"auto": _auto, "short": _short, AIMED: _auto_target}
)
"""Designs of constant mean delay against an arm's four lowest modes: one that leaves less, one that is shorter, and one
that knows where a motion will end."""


def names() -> tuple[str, ...]:
    """Of every filter there is."""
    return (*SHAPERS, *DESIGNS)


def check_name(name: str) -> None:
    """Check that there is a filter of a name.

    Raises:
        UnknownShaperError: There is none; it lists those there are and the nearest.
    """
    if name not in DESIGNS and name not in SHAPERS:
        near = get_close_matches(name, names(), n=1)
        raise UnknownShaperError(name, names(), near[0] if near else None)


def modes_of(name: str, modes: int = 1) -> int:
    """How many modes the filter of a name wants to know: a shaper as many as it is to suppress.

    Args:
        name: Of the filter.
        modes: How many a shaper is to suppress; a design has its own number.

    Raises:
        UnknownShaperError: There is none of that name.
    """
    check_name(name)
    return DESIGNS[name]().modes if name in DESIGNS else modes


def make_filter(name: str, estimator: Estimator, *, joints: int) -> Filter:
    """A filter by its name.

    Args:
        name: One of `names()`.
        estimator: Gives as many modes as `modes_of` says.
        joints: Entries of a sample.

    Raises:
        UnknownShaperError: There is none of that name.
        FilterError: Filter and estimator do not go together.
    """
    check_name(name)
    if name in DESIGNS:
        kind = AimedFilter if name == AIMED else SteadyFilter
        return kind(DESIGNS[name](), estimator, joints=joints)
    return TvistFilter(shaper(name), estimator, joints=joints)

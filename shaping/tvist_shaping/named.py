"""Filters by name: the catalogue, designs with constant mean delay, smoothing, and the user's own shapers."""

import re
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from functools import partial
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from tvist_shaping.base import FeedForward, Filter
from tvist_shaping.catalogue import SHAPERS
from tvist_shaping.designs import ConstantDesign, SmoothedDesign, TargetDesign, running_means
from tvist_shaping.errors import DesignError, UnknownShaperError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.filter import TvistFilter
from tvist_shaping.fir import FirDesign
from tvist_shaping.fir_shaper import FirShaper
from tvist_shaping.shaper import Shaper
from tvist_shaping.steady import AimedFilter, Design, ShortDesign, SteadyFilter

AnyShaper: TypeAlias = Shaper | FirShaper  # types that a user's own shaper may have


SLOW_HZ = 5.5
"""If an arm's lowest frequency is below this [Hz], the designs' times grow with the longest period."""
LIGHT = 0.040
"""If ZV shapers of the two lowest modes have a mean delay above this at q = 0 [s], the designs' times grow.

The less an arm is damped, the later its weights have to be.
"""


def _brief(mean_delay: float, residual: float, third: float, name: str, slower: float) -> ShortDesign:
    wanted = FirDesign(
        residual=(residual, residual, third, 0.2), shortest=0.05 * slower, longest=0.15 * slower
    )
    return ShortDesign(mean_delay * slower, wanted=wanted, name=name)


_auto = partial(_brief, 0.030, 0.035, 0.06, "auto")
AIMED, ELASTIC_AUTO = "auto-target", "elastic-auto"
DESIGNS: Mapping[str, Callable[[float], Design]] = MappingProxyType(
    {
        "auto": _auto,
        "short": partial(_brief, 0.028, 0.05, 0.08, "short"),
        AIMED: lambda slower: TargetDesign(_brief(0.026, 0.035, 0.06, AIMED, slower), slower),
        ELASTIC_AUTO: lambda slower: SmoothedDesign(_auto(slower), running_means(8, 8), ELASTIC_AUTO),
    }
)
"""Designs with constant mean delay for an arm's four lowest modes; the argument is the factor of their times.

`auto` has a smaller residual, `short` is shorter, `auto-target` is for motions with a known end, and
`elastic-auto` removes the vibration that elastic feed-forward leaves.
"""
SMOOTHED: Mapping[str, FeedForward] = MappingProxyType(
    {"elastic": "elastic", "elastic-position": "elastic-position"}
)
"""Filters that only smooth the reference, and the feed-forward that suppresses the vibration."""
SMOOTHING = 40  # length of the smoothing if the name contains none [ms]
SMOOTHINGS = range(8, 62, 2)
"""Lengths that a name may contain, as in `elastic-16` [ms].

With a shorter one, the torque is too small for elastic feed-forward; a longer one gains little.
"""
FIRST = 0.63  # share of the first of two running means in the total length, tuned at 40 ms [-]
_LENGTH = re.compile(r"(.+)-(0|[1-9][0-9]{0,8})")
OF_SEVERAL_MODES: Mapping[str, str] = MappingProxyType(
    {
        "auto": "four modes with any payload, at a constant mean delay: keeps the limits",
        "short": "like auto: shorter, leaves slightly more",
        AIMED: "zv for the three lowest modes at a motion's known end; like auto for other motions",
        "elastic": "smoothing alone, and feed-forward of the arm's elasticity: half the delay of auto; elastic-16 "
        "smooths over 16 ms, from 8 to 60, instead of 40",
        "elastic-position": "like elastic, for drives that take positions and velocities, but no torques",
        ELASTIC_AUTO: "auto, smoothed, with feed-forward of the arm's elasticity: leaves least",
    }
)
"""Descriptions of the filters that are not in the catalogue, by name."""
USES: Mapping[str, str] = MappingProxyType(
    {
        "elastic-auto": "the least vibration, also with an inexact model",
        "elastic": "the least delay, with a calibration that fits",
        AIMED: "moves to a known target, by drives that take no torques",
        "auto": "streams and whatever has no known end, by drives that take no torques",
    }
)
"""Purpose for which each filter is best, as measured; docs/how-to/evaluate-a-shaper.md has the figures."""

PERIOD = 0.002  # tick of every filter that is created by name [s]
_NAME = re.compile(r"[a-z0-9][a-z0-9_.,()-]{0,63}")


class Registry:
    """Immutable registry of filters by name for references at 500 Hz: this package's, and the user's own shapers.

    Args:
        own: The user's own shapers, `Shaper` or `FirShaper`.

    Raises:
        DesignError: A name is invalid or belongs to another shaper; or a `FirShaper` has another period.
    """

    def __init__(self, own: Iterable[AnyShaper] = ()) -> None:
        found: dict[str, AnyShaper] = {}
        for shaper in own:
            if not (isinstance(shaper.name, str) and _NAME.fullmatch(shaper.name)):
                limit = "1 to 64 of a-z 0-9 _ - . , ( ), the first a letter or a digit"
                raise DesignError("name", shaper.name, limit)
            if shaper.name in {*SHAPERS, *DESIGNS, *found} or _smoothing(shaper.name):
                raise DesignError("name", shaper.name, "a name that no other shaper has")
            if isinstance(shaper, FirShaper) and shaper.period != PERIOD:
                raise DesignError("period", shaper.period, f"{PERIOD:g} s, as that of all filters by name")
            found[shaper.name] = shaper
        self.own: Mapping[str, AnyShaper] = MappingProxyType(found)

    def names(self) -> tuple[str, ...]:
        """Names of all available filters."""
        return (*SHAPERS, *DESIGNS, *SMOOTHED, *self.own)

    def check(self, name: str) -> None:
        """Check that there is a filter with this name.

        Raises:
            UnknownShaperError: There is no shaper of that name; the error lists all names and the most similar one.
            DesignError: The name contains a smoothing length that is out of range.
        """
        if name not in self.names() and not _smoothing(name):
            near = get_close_matches(name, self.names(), n=1)
            raise UnknownShaperError(name, self.names(), near[0] if near else None)

    def modes_of(self, name: str, modes: int = 1) -> int:
        """Return the number of modes that a filter needs.

        Args:
            name: Name of the filter.
            modes: Number of modes that a shaper of impulses suppresses; a design or a FIR filter has its own number.

        Raises:
            UnknownShaperError: There is no shaper of that name.
        """
        self.check(name)
        shaper = self.own.get(name)
        if isinstance(shaper, FirShaper):
            return shaper.modes
        if _smoothing(name):
            return 1
        return DESIGNS[name](1.0).modes if name in DESIGNS else modes

    def feed_forward_of(self, name: str) -> FeedForward:
        """Return the feed-forward for the drives that a filter needs, see `Filter.feed_forward`.

        Raises:
            UnknownShaperError: There is no shaper of that name.
        """
        self.check(name)
        smoothing = _smoothing(name)
        return smoothing[0] if smoothing else "elastic" if name == ELASTIC_AUTO else "rigid"

    def make_filter(self, name: str, estimator: Estimator, *, joints: int) -> Filter:
        """Create a filter by name.

        Args:
            name: One of `names()`.
            estimator: Estimator with as many modes as `modes_of` returns.
            joints: Number of joints of the arm.

        Raises:
            UnknownShaperError: There is no shaper of that name.
            FilterError: Filter and estimator do not fit together.
            ShaperFailureError: The function of a user's own shaper fails for the modes at q = 0.
        """
        feed_forward, smoothing = self.feed_forward_of(name), _smoothing(name)
        if smoothing:
            both = smoothing[1] // 2 + 2  # ticks of both running means
            first = round(FIRST * both)
            design = ConstantDesign(name, running_means(first, both - first), estimator.modes)
            return SteadyFilter(design, estimator, joints=joints, feed_forward=feed_forward)
        if name in DESIGNS:
            kind = AimedFilter if name == AIMED else SteadyFilter
            f_d, zeta = (values[:2] for values in estimator.settle(np.zeros(joints)))
            later = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
            mean_delay = float(np.sum(later / (1.0 + later) / (2.0 * f_d)))
            slower = max(1.0, SLOW_HZ / estimator.f_d_min, mean_delay / LIGHT)
            return kind(DESIGNS[name](slower), estimator, joints=joints, feed_forward=feed_forward)
        shaper = self.own[name] if name in self.own else SHAPERS[name]
        if isinstance(shaper, FirShaper):
            return SteadyFilter(shaper.design(), estimator, joints=joints)
        return TvistFilter(shaper, estimator, joints=joints)


def _smoothing(name: str) -> tuple[FeedForward, int] | None:
    """Return feed-forward and length [ms] of a filter that only smooths; None for any other name."""
    if name in SMOOTHED:
        return SMOOTHED[name], SMOOTHING
    found = _LENGTH.fullmatch(name)
    if found is None or found[1] not in SMOOTHED:
        return None
    length = int(found[2])
    if length not in SMOOTHINGS:
        limit = f"even, from {SMOOTHINGS.start} to {SMOOTHINGS[-1]} ms, as in {found[1]}-16"
        raise DesignError(f"length of {found[1]}", length, limit)
    return SMOOTHED[found[1]], length


BUILT_IN = Registry()
"""The registry without own shapers."""


def make_filter(shaper: str | AnyShaper, estimator: Estimator, *, joints: int) -> Filter:
    """Create a filter for a sampled reference at 500 Hz, at rest at q = 0; `reset` moves it to the arm's configuration.

    Args:
        shaper: Name of a shaper of this package, as `BUILT_IN.names()` lists them, or your own shaper.
        estimator: The modes as functions of q. The names in `DESIGNS` require four modes, and a `FirShaper` its
            declared number; for others, this determines how many modes are suppressed.
        joints: Number of joints of the arm, >= 1.

    Raises:
        UnknownShaperError: There is no shaper of that name.
        DesignError: Your shaper's name is invalid or belongs to another one, or it has another period.
        FilterError: Shaper and estimator do not fit together.
        ShaperFailureError: The function of your shaper fails for the modes at q = 0.
    """
    if isinstance(shaper, str):
        return BUILT_IN.make_filter(shaper, estimator, joints=joints)
    if SHAPERS.get(shaper.name) is shaper:
        return BUILT_IN.make_filter(shaper.name, estimator, joints=joints)
    return Registry([shaper]).make_filter(shaper.name, estimator, joints=joints)

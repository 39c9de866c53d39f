"""A time-varying filter that keeps the limits of what it shapes: its mean delay does not change.

Where the reference is a parabola for as long as the filter is, a filter of mean delay D and variance S of its delays
gives y = x(t - D) + ẍ S/2. While D changes, the velocity is ẋ (1 - Ḋ): above the reference's while the delay shrinks,
and the acceleration has -ẋ D̈ in it. With D the same at every configuration both are gone; what is left is S̈/2, a
thousandth. It costs the difference between the longest mean delay there is and the present one.

Taps are designed every few ticks and averaged, three running means one after the other, so that they move without
kinks; the mean of tap vectors of one sum and one mean delay has these, too.
"""

import copy
import math
from abc import ABC, abstractmethod
from typing import Self

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.base import Filter
from tvist_shaping.errors import FilterError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.failures import FAILURES, failure
from tvist_shaping.fir import EDGE, GAIN, QUICKEST, FirDesign, Programme, solve
from tvist_shaping.taps import average, length, product_taps

EVERY = 4
"""Ticks between two designs."""
SMOOTH = 64
"""Ticks of each running mean: fewer let the spread of the delays change too fast, more let it lag behind the arm."""
EXCESS = 0.005
"""Share by which the acceleration may exceed the reference's [-]: the most on random motions at their limits."""


class Design(ABC):
    """Design that computes taps from modes."""

    name: str
    """What the filter is called."""
    modes: int
    """Modes it wants to know."""
    taps: int
    """Number of taps."""
    period: float
    """Tick [s]."""
    peak: float = 1.0
    """Sum of the taps' magnitudes at the most, 1 where none is negative [-]."""

    @abstractmethod
    def fork(self) -> Self:
        """Return a copy for another filter with the state of this one, so that it continues from here."""

    @abstractmethod
    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Taps for a reference that has been at rest for ever; as `go_on`."""

    @abstractmethod
    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Taps some time after the last.

        Args:
            f_d: Damped frequencies [Hz], shape (modes,).
            zeta: Damping ratios [-], shape (modes,).
            seconds: Since the last ones [s].
            taps: Result, shape (taps,), sum 1.

        Returns:
            Whether they are what was asked for; False where a delay had to be clipped.
        """


class ProductDesign(Design):
    """The modes' zero-vibration shapers, one after the other, held back to a mean delay."""

    def __init__(
        self, mean_delay: float, *, modes: int = 3, longest: float = 0.26, period: float = 0.002
    ) -> None:
        """A design.

        Args:
            mean_delay: The longest that the product has anywhere where the arm goes [s], > 0.
            modes: Number of modes, 1 to 6.
            longest: Longest delay of an impulse that is not clipped [s].
            period: Tick [s], > 0.

        Raises:
            FilterError: A number is out of range.
        """
        if not 1 <= modes <= 6:
            raise FilterError("modes", modes, "1 to 6: the product has 2^modes impulses")
        _check_times(mean_delay, longest, period)
        self.name, self.modes, self.mean_delay = "product", modes, mean_delay
        self.period, self.taps = period, math.ceil(longest / period) + 3
        self._longest = longest

    def __repr__(self) -> str:
        return f"ProductDesign(mean_delay={self.mean_delay:g}, modes={self.modes})"

    def fork(self) -> Self:
        """Itself: it remembers nothing."""
        return self

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps as `go_on` does, since this design has no state."""
        return product_taps(f_d, zeta, self.mean_delay, self.period, taps)

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:  # noqa: ARG002
        """Taps for these modes; see `Design.go_on`."""
        return product_taps(f_d, zeta, self.mean_delay, self.period, taps)


class ShortDesign(Design):
    """Positive taps from a quadratic programme, as short as what may remain allows: `tvist_shaping.fir`."""

    def __init__(
        self,
        mean_delay: float = 0.028,
        *,
        wanted: FirDesign | None = None,
        period: float = 0.002,
        name: str = "short",
    ) -> None:
        """A design.

        Args:
            mean_delay: Mean delay of the taps everywhere [s], > 0 and within the shortest length less its edge.
            wanted: What it is to reach.
            period: Tick [s], > 0.
            name: What it is called.

        Raises:
            FilterError: A number is out of range.
        """
        wanted = wanted or FirDesign()
        _check_times(mean_delay, wanted.shortest - EDGE, period)
        self.name, self.modes, self.mean_delay = name, wanted.modes, mean_delay
        self.wanted, self.period = wanted, period
        self.taps = math.ceil(wanted.longest / period) + 1
        self._residual = np.array(wanted.residual, dtype=float)
        self._programme = Programme.of(wanted, self.taps)
        self._length, self._solved = 0.0, False

    def __repr__(self) -> str:
        return f"ShortDesign(mean_delay={self.mean_delay:g}, wanted={self.wanted!r})"

    def fork(self) -> Self:
        """A copy with the present length and the present solution of the programme."""
        other = copy.copy(self)
        other._part()  # noqa: SLF001  one of its own kind
        return other

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Taps of the shortest length at which no more remains than may; as `go_on`."""
        shortest, longest = self.wanted.shortest, self.wanted.longest
        self._programme.dual[:] = 0.0
        for _ in range(11):  # what remains falls with the length: halve the interval
            self._length = 0.5 * (shortest + longest)
            self._solve(f_d, zeta, taps)
            if self._excess() > 0.0:
                shortest = self._length
            else:
                longest = self._length
        self._length = longest
        self._solve(f_d, zeta, taps)
        if not self._solved:
            taps[:] = self._programme.taps
        return self._solved and self._excess() <= 0.0

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Taps of a length that has followed what remains; see `Design.go_on`."""
        self._solve(f_d, zeta, taps)
        change = seconds * min(max(GAIN * self._excess(), -QUICKEST), QUICKEST)
        self._length = min(max(self._length + change, self.wanted.shortest), self.wanted.longest)
        return self._solved and (self._length < self.wanted.longest or self._excess() <= 0.0)

    def _part(self) -> None:
        self._programme = self._programme.fork()

    def _solve(self, f_d: Floats, zeta: Floats, taps: Floats) -> None:
        """New taps; where none are found the old ones stand, whose mean delay is the right one."""
        self._solved = solve(f_d, zeta, self._length, self.mean_delay, self.period, self._programme)
        if self._solved:
            taps[:] = self._programme.taps

    def _excess(self) -> float:
        """What remains against what may: logarithm, so that it is 0 where they are equal."""
        return 0.5 * math.log(float(((self._programme.remains / self._residual) ** 2).sum()) + 1e-12)


class SteadyFilter(Filter):
    """Time-varying shaping with a constant mean delay.

    An estimator may know modes as low as its `f_d_min`, and be far from them everywhere the arm goes. So a design is
    not refused because it would be too short for these: where it is too short for the modes there are, `clipped` says
    so at that tick, and no delay is longer than the line holds.

    Attributes:
        design: Makes the taps.
    """

    design: Design

    def __init__(self, design: Design, estimator: Estimator, *, joints: int, smooth: int = SMOOTH) -> None:
        """A filter at rest at q = 0; `reset` puts it where the arm is.

        Args:
            design: Makes the taps; it belongs to this filter alone.
            estimator: The modes as functions of q, as many as the design wants.
            joints: Entries of a sample, >= 1.
            smooth: Ticks of each of the three running means over the taps, >= 1.

        Raises:
            FilterError: A number is out of range, or the estimator has another number of modes.
            ShaperFailureError: The design fails for the modes at q = 0.
        """
        if smooth < 1:
            raise FilterError("smooth", smooth, "at least 1 tick")
        if estimator.modes != design.modes:
            raise FilterError(
                "modes", estimator.modes, f"{design.modes}, as design {design.name!r} wants",
                "take an estimator of that many modes, or another design",
            )  # fmt: skip
        super().__init__(design.name, estimator, joints, design.period, design.taps + 4)
        self.design, self.excess = design, EXCESS
        self._reach = design.taps
        self._smooth = smooth
        self._delays = np.arange(design.taps, dtype=float)
        self._designed, self._taps = np.zeros((2, design.taps))
        self._past, self._sums = np.zeros((3, smooth, design.taps)), np.zeros((3, design.taps))
        self._row, self._tick = 0, 0
        self.reset(self._q_star)
        self._check_made()

    def __repr__(self) -> str:
        return f"SteadyFilter({self.design!r}, {self.estimator!r}, joints={self.joints})"

    @property
    def delay(self) -> float:
        """Time of the last tap [s]: how much later the shaped reference ends."""
        return length(self._taps) * self.period

    @property
    def mean_delay(self) -> float:
        """Mean delay of the taps of the last tick [s]."""
        return float(self._taps @ self._delays) * self.period

    @property
    def peak(self) -> float:
        """See `Filter.peak`: the design's own."""
        return self.design.peak

    def _part(self) -> None:
        super()._part()
        self.design = self.design.fork()
        self._designed, self._taps = self._designed.copy(), self._taps.copy()
        self._past, self._sums = self._past.copy(), self._sums.copy()

    def _start(self) -> None:
        self._ask(self.estimator.settle(self._angles(self._q_star)), None)
        self._past[:] = self._designed
        self._sums[:] = self._designed * self._smooth
        self._taps[:] = self._designed
        self._row, self._tick = 0, 0

    def _weigh(self) -> None:
        if self._tick % EVERY == 0:
            self._ask(self._modes(), EVERY * self.period)
        self._tick += 1
        average(self._designed, self._past, self._sums, self._row, self._taps)
        self._row = (self._row + 1) % self._smooth
        self._line.gather(self._taps, self._delays, self._q_star)

    def _ask(self, modes: tuple[Floats, Floats], seconds: float | None) -> None:
        """Have taps designed for these modes, some time after the last; None: from rest."""
        self.f_d, self.zeta = modes
        try:
            if seconds is None:
                done = self.design.start(self.f_d, self.zeta, self._designed)
            else:
                done = self.design.go_on(self.f_d, self.zeta, seconds, self._designed)
        except FAILURES as error:
            self.fault, done = failure(error, self.f_d, self.zeta), False
        else:
            self.fault = None
        self.clipped = not done or self.estimator.clipped


def _check_times(mean_delay: float, longest: float, period: float) -> None:
    for name, value in (("mean_delay", mean_delay), ("longest", longest), ("period", period)):
        if not 0.0 < value < math.inf:
            raise FilterError(name, value, "a finite number of seconds above 0")
    if mean_delay >= longest:
        raise FilterError("mean_delay", mean_delay, f"less than the longest delay, {longest:g} s")

"""A time-varying filter with constant mean delay, which keeps the limits of its reference.

If the reference is a parabola over the length of the filter, a filter with mean delay D and variance S of its delays
gives y = x(t - D) + ẍ S/2. While D changes, the velocity is ẋ (1 - Ḋ), which exceeds the reference's while the delay
shrinks, and the acceleration contains -ẋ D̈. If D is the same at every configuration, both effects vanish; what remains
is S̈/2, a thousandth. The price is that motions always have the longest mean delay of any configuration.

Taps are designed every few ticks and averaged by three running means in series, so that they change smoothly; a mean of
tap vectors with equal sum and mean delay has the same sum and mean delay.
"""

import math
from abc import ABC, abstractmethod
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats, Forkable
from tvist_shaping.base import FeedForward, Filter
from tvist_shaping.errors import FilterError, check_positive
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.failures import FAILURES, failure
from tvist_shaping.fir import EDGE, GAIN, QUICKEST, FirDesign, QuadraticProgramme, solve
from tvist_shaping.taps import average, length, product_taps

DESIGN_TICKS = 4  # ticks between two designs
SMOOTH = 64
"""Ticks of each running mean: with fewer, the variance of the delays changes too fast; with more, taps lag."""
EXCESS = 0.005
"""Largest share by which shaped acceleration exceeded the reference's in random motions at the limits [-]."""


class Design(Forkable, ABC):
    """Base class of designs, which compute taps from modes."""

    name: str
    """Name of the filter."""
    modes: int
    """Number of modes that the design needs."""
    taps: int
    """Number of taps."""
    period: float
    """Tick [s]."""
    peak: float = 1.0
    """Upper bound of the sum of the taps' magnitudes; 1 if none is negative [-]."""
    constant: bool = False
    """True if the taps do not depend on the modes, which are then estimated only to be reported."""

    @abstractmethod
    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for a reference that has always been at rest; return False if they miss a requirement.

        Args:
            f_d: Damped frequencies [Hz], shape (modes,).
            zeta: Damping ratios [-], shape (modes,).
            taps: Result, shape (taps,), with sum 1.
        """

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:  # noqa: ARG002
        """Compute the taps `seconds` after the last ones; by default, as `start` for these modes."""
        return self.start(f_d, zeta, taps)

    def at_target(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps of a whole motion for the modes at its known end; by default, as `start`."""
        return self.start(f_d, zeta, taps)

    def mean_delay_of(self, f_d: Floats, zeta: Floats) -> float | None:  # noqa: ARG002  unless overridden
        """See `Filter.mean_delay_of`."""
        return None


class ProductDesign(Design):
    """The modes' zero-vibration shapers in series, delayed to a constant mean delay."""

    def __init__(
        self, mean_delay: float, *, modes: int = 3, longest: float = 0.26, period: float = 0.002
    ) -> None:
        """Create a design.

        Args:
            mean_delay: Longest mean delay of the product anywhere in the workspace [s], > 0.
            modes: Number of modes, 1 to 6.
            longest: Longest delay of an impulse without clipping [s].
            period: Tick [s], > 0.

        Raises:
            FilterError: An argument is out of range.
        """
        if not 1 <= modes <= 6:
            raise FilterError("modes", modes, "1 to 6: the product has 2^modes impulses")
        _check_times(mean_delay, longest, period)
        self.name, self.modes, self.mean_delay = "product", modes, mean_delay
        self.period, self.taps = period, math.ceil(longest / period) + 3

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for these modes."""
        return product_taps(f_d, zeta, self.mean_delay, self.period, taps)


class ShortDesign(Design):
    """Positive taps from a quadratic programme, as short as the permitted residual allows: `tvist_shaping.fir`."""

    def __init__(
        self,
        mean_delay: float = 0.028,
        *,
        wanted: FirDesign | None = None,
        period: float = 0.002,
        name: str = "short",
    ) -> None:
        """Create a design.

        Args:
            mean_delay: Mean delay of the taps at every configuration [s], > 0 and within the shortest length minus
                its edge.
            wanted: Requirements for the taps.
            period: Tick [s], > 0.
            name: Name of the filter.

        Raises:
            FilterError: An argument is out of range.
        """
        wanted = wanted or FirDesign()
        _check_times(mean_delay, wanted.shortest - EDGE, period)
        self.name, self.modes, self.mean_delay = name, wanted.modes, mean_delay
        self.wanted, self.period = wanted, period
        self.taps = math.ceil(wanted.longest / period) + 1
        self._programme = QuadraticProgramme.of(wanted, self.taps)
        self._length, self._solved = 0.0, False

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute taps of the shortest length with a permitted residual."""
        shortest, longest = self.wanted.shortest, self.wanted.longest
        self._programme.dual[:] = 0.0
        for _ in range(11):  # the residual decreases with the length, so bisect
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
        """Compute taps whose length follows the residual."""
        self._solve(f_d, zeta, taps)
        excess = self._excess()
        change = seconds * min(max(GAIN * excess, -QUICKEST), QUICKEST)
        self._length = min(max(self._length + change, self.wanted.shortest), self.wanted.longest)
        return self._solved and (self._length < self.wanted.longest or excess <= 0.0)

    def fork(self) -> Self:
        """Return an independent copy; see `Filter.fork`."""
        other = super().fork()
        other._programme = self._programme.fork()  # noqa: SLF001  one of its own kind
        return other

    def _solve(self, f_d: Floats, zeta: Floats, taps: Floats) -> None:
        """Compute new taps; if none are found, keep the old ones, which have the right mean delay."""
        self._solved = solve(f_d, zeta, self._length, self.mean_delay, self.period, self._programme)
        if self._solved:
            taps[:] = self._programme.taps

    def _excess(self) -> float:
        """Return the logarithm of the ratio of the residual to the permitted one; 0 if they are equal."""
        square = 0.0
        for remains, permitted in zip(self._programme.remains.tolist(), self.wanted.residual, strict=True):
            square += (remains / permitted) * (remains / permitted)
        return 0.5 * math.log(square + 1e-12)


class SteadyFilter(Filter):
    """Time-varying shaping by taps with a constant mean delay, or by constant taps.

    An estimator's `f_d_min` may be far below the modes anywhere in the workspace, so a design that is too short for it
    is not refused. If it is too short for the actual modes, `clipped` is True at that tick, and no delay exceeds the
    delay line.

    Attributes:
        design: Computes the taps.
    """

    initial_excess = EXCESS
    """Initial value of `excess` [-]."""

    def __init__(
        self,
        design: Design,
        estimator: Estimator,
        *,
        joints: int,
        feed_forward: FeedForward = "rigid",
    ) -> None:
        """Create a filter at rest at q = 0; `reset` moves it to the arm's configuration.

        Args:
            design: Computes the taps; it must not be shared with another filter.
            estimator: The modes as functions of q, as many as the design needs.
            joints: Number of joints of the arm, >= 1.
            feed_forward: Feed-forward that the drives need with it.

        Raises:
            FilterError: An argument is out of range, or the estimator has another number of modes.
            ShaperFailureError: The design fails for the modes at q = 0.
        """
        if estimator.modes != design.modes:
            raise FilterError(
                "modes", estimator.modes, f"{design.modes}, as design {design.name!r} wants",
                "take an estimator of that many modes, or another design",
            )  # fmt: skip
        super().__init__(design.name, estimator, joints, design.period, design.taps + 4, design.peak)
        self.design, self.feed_forward = design, feed_forward
        self.excess = 0.0 if design.constant else self.initial_excess
        self._reach = design.taps
        self._smooth = 1 if design.constant else SMOOTH
        self._delays = np.arange(design.taps, dtype=float)
        self._designed, self._taps = np.zeros((2, design.taps))
        self._past, self._sums = np.zeros((3, self._smooth, design.taps)), np.zeros((3, design.taps))
        self._row, self._tick = 0, 0
        self._length = 0
        self.reset(self._q_star)
        self._check_made()

    @property
    def delay(self) -> float:
        """Time of the last tap [s]; the shaped reference ends later by this time."""
        return self._length * self.period

    @property
    def mean_delay(self) -> float:
        """Mean delay of the taps of the last tick [s]."""
        return float(self._taps @ self._delays) * self.period

    def mean_delay_of(self, f_d: Floats, zeta: Floats) -> float | None:
        """The design's value [s]; see `Filter.mean_delay_of`."""
        return self.design.mean_delay_of(f_d, zeta)

    def _start(self) -> None:
        self._ask(self.estimator.settle(self._angles(self._q_star)), None)
        self._past[:] = self._designed
        self._sums[:] = self._designed * self._smooth
        self._taps[:], self._length = self._designed, length(self._designed)
        self._row, self._tick = 0, 0

    def _weigh(self) -> None:
        if self._tick % DESIGN_TICKS == 0:
            self._ask(self._modes(), DESIGN_TICKS * self.period)
        self._tick += 1
        if not self.design.constant:
            self._length = average(self._designed, self._past, self._sums, self._row, self._taps)
            self._row = (self._row + 1) % self._smooth
        self._line.gather(self._taps, self._delays, self._q_star)

    def _ask(self, modes: tuple[Floats, Floats], seconds: float | None) -> None:
        """Compute taps for these modes, `seconds` after the last ones; None for a start at rest."""
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


class AimedFilter(SteadyFilter):
    """Filter whose weights fit the modes at a motion's known end, where the arm vibrates after the motion.

    Constant weights cannot exceed the limits of the reference, need no averaging, and do not lag behind the arm, but
    they fit less well during the motion. If no end is known, as in a stream, the filter behaves like a `SteadyFilter`.
    """

    initial_excess = 0.0
    _aimed = False

    def aim(self, q: npt.ArrayLike | None) -> None:
        """Use the weights for the end of a motion; the reference must be at rest. See `Filter.aim`."""
        if q is None:
            self._start()
            return
        self.f_d, self.zeta = self.estimator.settle(self._angles(np.asarray(q, dtype=float)))
        done = self.design.at_target(self.f_d, self.zeta, self._taps)
        self._length = length(self._taps)
        self.fault, self.clipped = None, not done or self.estimator.clipped
        self._aimed = True

    def _start(self) -> None:
        self._aimed = False
        super()._start()

    def _weigh(self) -> None:
        if self._aimed:
            self._line.gather(self._taps, self._delays, self._q_star)
        else:
            super()._weigh()


def _check_times(mean_delay: float, longest: float, period: float) -> None:
    check_positive(FilterError, "seconds", mean_delay=mean_delay, longest=longest, period=period)
    if mean_delay >= longest:
        raise FilterError("mean_delay", mean_delay, f"less than the longest delay, {longest:g} s")

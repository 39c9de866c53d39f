"""Filters that know where a motion will end, and use the weights for that configuration from the start."""

import math

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.steady import Design, ShortDesign, SteadyFilter
from tvist_shaping.taps import length

AT_TARGET = 3
"""Number of modes, from the lowest on, that have a zero-vibration shaper in a motion with a known end."""
LONGEST = 0.26
"""Longest time of these shapers together, as long as the other design is not slowed down [s]."""


class TargetDesign(Design):
    """One design for motions without a known end, and for the others zero-vibration shapers for the modes there.

    The weights are constant in a motion with a known end, so they need no constant mean delay, which costs a lightly
    damped arm most of its reduction.
    """

    def __init__(self, design: ShortDesign, slower: float = 1.0) -> None:
        """Create a design.

        Args:
            design: The design for motions without a known end; it must not be shared with another filter.
            slower: Factor of all times [-].
        """
        self.name, self.modes, self.period = design.name, design.modes, design.period
        self.taps = math.ceil(LONGEST * slower / self.period) + 3
        self._design = design

    def __repr__(self) -> str:
        return f"TargetDesign({self._design!r})"

    def fork(self) -> "TargetDesign":
        """Return a copy with the state of this one."""
        other = TargetDesign(self._design.fork())
        other.taps = self.taps
        return other

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps without a known end, for a reference at rest; see `Design.start`."""
        taps[self._design.taps :] = 0.0
        return self._design.start(f_d, zeta, taps[: self._design.taps])

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Compute the taps without a known end, some time later; see `Design.go_on`."""
        return self._design.go_on(f_d, zeta, seconds, taps[: self._design.taps])

    def at_target(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for the modes at the end of a motion; arguments and result as in `Design.start`.

        Impulses between two ticks are shared by both, so that no tap is negative and all limits are kept exactly.
        """
        sizes, ticks = np.ones(1), np.zeros(1)
        for f, z in zip(f_d[:AT_TARGET], zeta[:AT_TARGET], strict=True):
            later = math.exp(-math.pi * z / math.sqrt(1.0 - z * z))
            sizes = np.outer(sizes, [1.0 / (1.0 + later), later / (1.0 + later)]).ravel()
            ticks = np.add.outer(ticks, [0.0, 0.5 / (f * self.period)]).ravel()
        within = np.minimum(ticks, self.taps - 2.0)
        first = within.astype(np.int64)
        taps[:] = 0.0
        np.add.at(taps, first, sizes * (1.0 - within + first))
        np.add.at(taps, first + 1, sizes * (within - first))
        return bool(np.array_equal(within, ticks))


class AimedFilter(SteadyFilter):
    """Filter for motions with a known end, since the vibration after a motion has the modes of the arm at its end.

    Constant weights cannot exceed the limits of the reference, need no averaging, and do not lag behind the arm.
    During the motion, while the arm is elsewhere, they fit less well. If no end is known, as in a stream, the filter
    behaves like a `SteadyFilter`.
    """

    spared = 0.0
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

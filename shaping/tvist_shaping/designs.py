"""Designs built from other designs (smoothed, or with a known end of the motion), and constant taps."""

import math

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.steady import Design, ShortDesign

AT_TARGET = 3
"""Number of modes, from the lowest, that get a zero-vibration shaper in a motion with a known end."""
LONGEST = 0.26  # longest total time of these shapers, unless the design is slowed down [s]


class TargetDesign(Design):
    """Zero-vibration shapers for the modes at a known end of a motion, and another design for other motions.

    With a known end the weights do not change during a motion, so different ends may have different mean
    delays. If all ends had the same mean delay, a lightly damped arm would lose most of the reduction of its
    vibration.
    """

    def __init__(self, design: ShortDesign, slower: float = 1.0) -> None:
        """Create a design from one used by no other filter; `slower` multiplies all times, for a slow arm."""
        self.name, self.modes, self.period = design.name, design.modes, design.period
        self.taps = math.ceil(LONGEST * slower / self.period) + 3
        self._design = design

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps without a known end, for a reference at rest."""
        taps[self._design.taps :] = 0.0
        return self._design.start(f_d, zeta, taps[: self._design.taps])

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Compute the taps without a known end, some time later."""
        return self._design.go_on(f_d, zeta, seconds, taps[: self._design.taps])

    def at_target(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for the modes at the end of a motion.

        An impulse between two ticks is shared linearly by both, so no tap is negative and all limits are kept exactly.
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


class SmoothedDesign(Design):
    """The taps of another design, which no other filter uses, convolved with constant weights of sum 1."""

    def __init__(self, design: Design, weights: Floats, name: str) -> None:
        self.name, self.modes, self.period, self.peak = name, design.modes, design.period, design.peak
        self.taps = design.taps + len(weights) - 1
        self._design, self._weights, self._own = design, weights, np.zeros(design.taps)

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for a reference at rest."""
        done = self._design.start(f_d, zeta, self._own)
        taps[:] = np.convolve(self._own, self._weights)
        return done

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Compute the taps some time later."""
        done = self._design.go_on(f_d, zeta, seconds, self._own)
        taps[:] = np.convolve(self._own, self._weights)
        return done


class ConstantDesign(Design):
    """Constant non-negative weights with sum 1; elastic feed-forward suppresses the vibration."""

    constant = True

    def __init__(self, name: str, weights: Floats, modes: int, period: float = 0.002) -> None:
        self.name, self.weights, self.modes = name, weights, modes
        self.taps, self.period = len(weights), period

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:  # noqa: ARG002  the same for all modes
        """Return the weights."""
        taps[:] = self.weights
        return True


def running_means(*ticks: int) -> Floats:
    """Return weights of running means in series, each over a number of ticks, shape (sum - count + 1,)."""
    weights: Floats = np.ones(1)
    for count in ticks:
        weights = np.convolve(weights, np.full(count, 1.0 / count))
    return weights

"""Smoothing by running means, for references whose fourth derivative is needed."""

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.base import FeedForward, Filter
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.steady import EVERY, Design
from tvist_shaping.taps import length


def running_means(*ticks: int) -> Floats:
    """Weights of consecutive running means over numbers of ticks, shape (sum - count + 1,), with sum 1."""
    weights: Floats = np.ones(1)
    for count in ticks:
        weights = np.convolve(weights, np.full(count, 1.0 / count))
    return weights


class SmoothingFilter(Filter):
    """Constant weights, whatever the modes; feed-forward of the arm's elasticity does the rest.

    Modes are only estimated in order to be reported.

    Attributes:
        weights: Weights of the newest samples, shape (N,).
    """

    weights: Floats

    def __init__(
        self,
        name: str,
        weights: Floats,
        estimator: Estimator,
        *,
        joints: int,
        feed_forward: FeedForward,
        period: float = 0.002,
    ) -> None:
        """Create a filter at rest at q = 0; `reset` moves it to the arm's configuration.

        Args:
            name: Name of the filter.
            weights: Weights of the newest samples, none negative, with sum 1, shape (N,).
            estimator: The modes as functions of q.
            joints: Number of joints of the arm, >= 1.
            feed_forward: Feed-forward that the drives need with it.
            period: Tick [s], > 0.
        """
        super().__init__(name, estimator, joints, period, len(weights) + 4)
        self.weights, self.feed_forward = weights, feed_forward
        self._delays = np.arange(len(weights), dtype=float)
        self._reach, self._delay = len(weights), length(weights) * period
        self._tick = 0
        self.reset(self._q_star)

    def __repr__(self) -> str:
        return f"SmoothingFilter({self.name!r}, {len(self.weights)} weights, joints={self.joints})"

    @property
    def delay(self) -> float:
        """Time of the last weight [s], by which the shaped reference ends later."""
        return self._delay

    @property
    def mean_delay(self) -> float:
        """Mean delay of the weights [s]."""
        return float(self.weights @ self._delays) * self.period

    def _start(self) -> None:
        self.f_d, self.zeta = self.estimator.settle(self._angles(self._q_star))
        self._tick = 0

    def _weigh(self) -> None:
        if self._tick % EVERY == 0:
            self.f_d, self.zeta = self._modes()
            self.clipped = self.estimator.clipped
        self._tick += 1
        self._line.gather(self.weights, self._delays, self._q_star)


class SmoothedDesign(Design):
    """Another design's taps, followed by constant weights."""

    def __init__(self, design: Design, weights: Floats, name: str) -> None:
        """Create a design.

        Args:
            design: The other design; it must not be shared with another filter.
            weights: Weights that follow its taps, none negative, with sum 1, shape (N,).
            name: Name of the filter.
        """
        self.name, self.modes, self.period, self.peak = name, design.modes, design.period, design.peak
        self.taps = design.taps + len(weights) - 1
        self._design, self._weights, self._own = design, weights, np.zeros(design.taps)

    def __repr__(self) -> str:
        return f"SmoothedDesign({self._design!r}, {len(self._weights)} weights)"

    def fork(self) -> "SmoothedDesign":
        """Return a copy with the state of this one."""
        other = SmoothedDesign(self._design.fork(), self._weights, self.name)
        other._own[:] = self._own
        return other

    def start(self, f_d: Floats, zeta: Floats, taps: Floats) -> bool:
        """Compute the taps for a reference at rest; see `Design.start`."""
        done = self._design.start(f_d, zeta, self._own)
        taps[:] = np.convolve(self._own, self._weights)
        return done

    def go_on(self, f_d: Floats, zeta: Floats, seconds: float, taps: Floats) -> bool:
        """Compute the taps some time later; see `Design.go_on`."""
        done = self._design.go_on(f_d, zeta, seconds, self._own)
        taps[:] = np.convolve(self._own, self._weights)
        return done

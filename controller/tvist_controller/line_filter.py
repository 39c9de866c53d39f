"""The filter on the control line, and the way from one filter to the next."""

import copy
from typing import Self

import numpy as np

from tvist_controller.control.differentiator import Floats
from tvist_controller.trajectory import MotionLimits
from tvist_shaping.base import Filter, Posture
from tvist_shaping.fade import Fade


class LineFilter:
    """Shapes with the filter that was chosen last; in motion the one before fades into it.

    Args:
        tvist: The first filter.
        limits: Limits of the motion that is shaped.
    """

    def __init__(self, tvist: Filter, limits: MotionLimits) -> None:
        self.tvist = tvist
        """The filter chosen last: in force, or about to be."""
        self.limits = limits
        """Limits of the current motion."""
        self._fade: Fade | None = None

    @property
    def fading(self) -> bool:
        """Whether one filter is giving way to another."""
        return self._fade is not None

    @property
    def settled(self) -> bool:
        """Whether nothing that is still to come of it can move, once its output stands where its reference does.

        Where weights are negative their echoes may cancel for a moment.
        """
        return self._fade is None and (self.tvist.peak == 1.0 or self.tvist.settled)

    @property
    def fault(self) -> str | None:
        """Why a shaper could give no weights at the last tick, with its name; None: each could."""
        fade = self._fade
        filters = (self.tvist,) if fade is None else (self.tvist, fade.old, fade.new)
        return next((f"shaper {one.name} {one.fault}" for one in filters if one.fault is not None), None)

    @property
    def peak(self) -> float:
        """By what factor the shaped acceleration may exceed the reference's, see `Filter.peak`."""
        fade = self._fade
        return self.tvist.peak if fade is None else max(self.tvist.peak, fade.old.peak, fade.new.peak)

    def filter(self, reference: Floats) -> Floats:
        """Shaped sample, on the way from one filter to another where there is one."""
        fade = self._fade
        if fade is None:
            return self.tvist.filter(reference)
        shaped = fade.filter(reference)
        if fade.new is not self.tvist:  # it waits for its turn
            self.tvist.filter(reference)
        if fade.finished:
            self._fade = None if fade.new is self.tvist else self._fade_to(fade.new, self.tvist)
        return shaped

    def use(self, tvist: Filter) -> None:
        """Change the filter within the limits of the motion.

        While one change is under way the next waits for its turn; of several that wait the newest does.

        Args:
            tvist: The filter to come; its joints and period are the present one's. It goes on with the present path.
        """
        fade = self._fade
        if fade is None or fade.share == 0.0:
            self._fade = self._fade_to(self.tvist if fade is None else fade.old, tvist)
        else:
            tvist.take_over(self.tvist)
        self.tvist = tvist

    def cut(self) -> None:
        """Be bypassed: what fades is dropped, and the next use begins from rest."""
        self._fade = None

    def begin(self, tvist: Filter, sample: Floats, posture_of: Posture | None = None) -> None:
        """Use a filter from rest.

        Args:
            tvist: The filter.
            sample: Rest of the reference: joint positions, shape (n,), or a path's parameter, shape (m,) [rad].
            posture_of: From a path's parameter to joint positions; None: samples are joint positions.
        """
        self.tvist, self._fade = tvist, None
        tvist.reset(sample, posture_of)

    def fork(self) -> Self:
        """An independent copy that goes on from here."""
        other, fade = copy.copy(self), self._fade
        if fade is None:
            other.tvist = self.tvist.fork()
        else:
            other._fade = fade.fork()  # noqa: SLF001  one of its own kind
            waits = fade.new is not self.tvist
            other.tvist = self.tvist.fork() if waits else other._fade.new  # noqa: SLF001  likewise
        return other

    def rehearse(self, q: Floats) -> None:
        """Filter a sample through a fade and take it back: the first time loads compiled code, for many ticks."""
        self._fade = self._fade_to(self.tvist.fork(), self.tvist)
        for _ in range(3):
            self.filter(q)
        self.begin(self.tvist, q)

    def window(self) -> Floats:
        """Samples that the filters may still read, the oldest first, shape (k, m) [rad]."""
        filters = [self.tvist] if self._fade is None else [self._fade.old, self._fade.new, self.tvist]
        return np.concatenate([tvist.window() for tvist in filters])

    def _fade_to(self, old: Filter, new: Filter) -> Fade:
        limits = self.limits
        return Fade(old, new, velocity=limits.velocity, acceleration=limits.acceleration, jerk=limits.jerk)

"""The filter on the control line, and transitions between filters."""

import copy
from typing import Self

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.trajectory import MotionLimits
from tvist_shaping.base import Filter, Posture
from tvist_shaping.fade import Fade


class LineFilter:
    """Shapes with the latest chosen filter; in motion, the previous filter fades into the new one."""

    def __init__(self, tvist: Filter, arm: MotionLimits) -> None:
        self.tvist = tvist  # the latest chosen filter, in use or next
        self._arm = arm
        self.limits = arm  # limits of the current motion
        self._fade: Fade | None = None

    @property
    def fading(self) -> bool:
        """Whether a transition is in progress."""
        return self._fade is not None

    @property
    def settled(self) -> bool:
        """True if the output rests at the reference; with negative weights it may also pass there."""
        return self._fade is None and (self.tvist.peak == 1.0 or self.tvist.settled)

    @property
    def fault(self) -> str | None:
        """Name and fault of a shaper that could not compute weights at the last tick; None without fault."""
        fade, tvist = self._fade, self.tvist
        if fade is None and tvist.fault is None:  # the usual case
            return None
        filters = (tvist,) if fade is None else (tvist, fade.old, fade.new)
        return next((f"shaper {one.name} {one.fault}" for one in filters if one.fault is not None), None)

    @property
    def peak(self) -> float:
        """Largest ratio of shaped to unshaped acceleration, see `Filter.peak`."""
        fade = self._fade
        return self.tvist.peak if fade is None else max(self.tvist.peak, fade.old.peak, fade.new.peak)

    def reduced_limits(self, limits: MotionLimits | None = None) -> MotionLimits:
        """Return reference limits with which the shaped reference keeps the arm's and the given limits."""
        arm, (faster, harder) = self._arm, (1.0 + more for more in self.tvist.excess_at_limits)
        limits = arm if limits is None else limits
        return MotionLimits(
            min(limits.velocity, arm.velocity / faster),
            min(limits.acceleration, arm.acceleration / harder),
            limits.jerk,
        )

    def filter(self, reference: Floats) -> Floats:
        """Return the shaped sample; during a transition, a mixture of both filters' outputs."""
        if (fade := self._fade) is None:
            return self.tvist.filter(reference)
        shaped = fade.filter(reference)
        if (
            fade.new is not self.tvist
        ):  # the latest filter waits for the end of the present transition, and needs the past references
            self.tvist.filter(reference)
        if fade.finished:
            self._fade = None if fade.new is self.tvist else self._fade_to(fade.new, self.tvist)
        return shaped

    def use(self, tvist: Filter) -> None:
        """Change the filter within the limits of the motion; during a transition, the new filter waits."""
        fade = self._fade
        if fade is None or fade.share == 0.0:
            old = self.tvist if fade is None else fade.old
            self._fade = self._fade_to(old, tvist)
            if fade is not None and old.settled and tvist.settled:
                self._fade = None  # otherwise, a change at each tick would keep the line from resting
        else:
            tvist.take_over(self.tvist)
        self.tvist = tvist

    def cut(self) -> None:
        """End a transition at once because references bypass the filter; the filter restarts from rest."""
        self._fade = None

    def begin(self, tvist: Filter, sample: Floats, posture_of: Posture | None = None) -> None:
        """Start a filter at rest, for joint positions or, with `posture_of`, a path's parameter."""
        self.tvist, self._fade = tvist, None
        tvist.reset(sample, posture_of)

    def fork(self) -> Self:
        """Return an independent copy."""
        other, fade = copy.copy(self), self._fade
        if fade is None:
            other.tvist = self.tvist.fork()
        else:
            other._fade = fade.fork()  # noqa: SLF001  one of its own kind
            waits = fade.new is not self.tvist
            other.tvist = self.tvist.fork() if waits else other._fade.new  # noqa: SLF001  likewise
        return other

    def window(self) -> Floats:
        """Return the samples that the filters may still use, oldest first, shape (k, m) [rad]."""
        filters = [self.tvist] if self._fade is None else [self._fade.old, self._fade.new, self.tvist]
        return np.concatenate([tvist.window() for tvist in filters])

    def _fade_to(self, old: Filter, new: Filter) -> Fade:
        limits = self.limits
        return Fade(old, new, velocity=limits.velocity, acceleration=limits.acceleration, jerk=limits.jerk)

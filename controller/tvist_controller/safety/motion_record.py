"""A motion from rest to rest, and what the arm's own sensors said meanwhile."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.sample import Sample
from tvist_controller.planning.snapshot import FilterState

LONGEST = 10_000
"""Number of ticks of the longest motion that is recorded; of a longer one nothing is kept."""
AFTER = 150
"""Number of ticks that are recorded after a motion has ended, in which the arm rings down."""


@dataclass(frozen=True)
class MotionRecord:
    """A motion of T ticks, of which the last ones are at rest."""

    q: Floats
    """Measured joint angles, shape (T, n) [rad]."""
    moments: Floats
    """Measured motor torques on the joint side, shape (T, n) [N m]."""
    stop: int
    """Number of ticks until the commands rested."""
    whole: bool
    """Whether it went as planned: shaped from rest to rest, without stop, stream or bypass."""
    beliefs: FilterState
    """What the controller took the arm for, and shaped with."""


Record = Callable[[], MotionRecord]
"""Makes the record of a motion that has ended, which takes longer than a tick has."""


class MotionRecorder:
    """Records one motion after the other."""

    def __init__(self) -> None:
        self._samples: list[Sample] = []
        self._ticks, self._stop = 0, 0
        self._whole = self._moves = False
        self._beliefs: FilterState | None = None

    def take(self, sample: Sample, present: Callable[[], FilterState]) -> Record | None:
        """Take a tick in which the drives hold or move the arm; return the motion that is complete with it.

        That may be one that the next one has cut short; None if there is none. What is believed at present is asked
        for at the beginning of a motion only.
        """
        resting, done = sample.mode.at_rest, None
        if not resting and (not self._moves or self._stop):
            done = self._finished()
            self.forget()
            self._moves, self._whole, self._beliefs = True, True, present()
        if not self._moves:
            return done
        self._whole = self._whole and (resting or sample.mode is LineMode.SHAPED)
        if self._ticks < LONGEST + AFTER:
            self._samples.append(sample)
        self._ticks += 1
        if resting and not self._stop:
            self._stop = self._ticks
        if self._stop and self._ticks == self._stop + AFTER:
            done = self._finished()
            self.forget()
        return done

    def forget(self) -> None:
        """Drop the present motion, since the drives do not hold the arm, or it was placed elsewhere."""
        self._moves, self._samples, self._ticks, self._stop = False, [], 0, 0

    def _finished(self) -> Record | None:
        samples, stop, whole, beliefs = self._samples, self._stop, self._whole, self._beliefs
        if not stop or stop > LONGEST or beliefs is None:
            return None

        def record() -> MotionRecord:
            q = np.array([sample.measured.q for sample in samples])
            return MotionRecord(
                q, np.array([sample.measured.moment for sample in samples]), stop, whole, beliefs
            )

        return record

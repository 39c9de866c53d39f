"""A motion from rest to rest, and what the arm's own sensors said meanwhile."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.sample import Sample
from tvist_protocol.values import Payload

LONGEST = 10_000
"""Number of ticks of the longest motion that is recorded; of a longer one nothing is kept."""
AFTER = 150
"""Number of ticks that are recorded after a motion has ended, in which the arm rings down."""


@dataclass(frozen=True)
class Beliefs:
    """What the controller took the arm for during a motion."""

    payload: Payload
    """Payload that dynamics and modes were computed with."""
    state: Any = None
    """State that plans for lessons depend on; what it is matters to those who make them alone."""


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
    beliefs: Beliefs
    """What the controller took the arm for."""


Record = Callable[[], MotionRecord]
"""Makes the record of a motion that has ended, which takes longer than a tick has."""


def record_of(samples: Sequence[Sample], stop: int, whole: bool, beliefs: Beliefs) -> MotionRecord:
    """Return the record of a motion from its ticks; see `MotionRecord`."""
    measured = [sample.measured for sample in samples]
    q, moments = (np.array(values) for values in zip(*((one.q, one.moment) for one in measured), strict=True))
    return MotionRecord(q, moments, stop, whole, beliefs)


class MotionRecorder:
    """Records one motion after the other."""

    def __init__(self) -> None:
        self._samples: list[Sample] = []
        self._ticks, self._stop = 0, 0
        self._whole = self._moves = False
        self._beliefs: Beliefs | None = None

    @property
    def begins(self) -> bool:
        """Whether the next tick in motion is the first one of a record, which needs to know what is believed."""
        return not self._moves or self._stop > 0

    def take(self, sample: Sample, beliefs: Beliefs | None = None) -> Record | None:
        """Take a tick in which the drives hold or move the arm; return the motion that is complete with it.

        That may be one that the next one has cut short; None if there is none. What the controller takes the
        arm for is used at the beginning of a motion only.
        """
        resting, done = sample.mode.at_rest, None
        if not resting and self.begins:
            done = self._finished()
            self._samples = []
            self._ticks, self._stop, self._moves, self._whole = 0, 0, True, True
            self._beliefs = beliefs
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
        if not self._stop or self._stop > LONGEST or self._beliefs is None:
            return None
        return partial(record_of, self._samples, self._stop, self._whole, self._beliefs)

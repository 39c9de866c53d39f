"""A motion from rest to rest as the drives were told to make it, and what the arm's own sensors said meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import Any

import msgspec
import numpy as np

from tvist_controller.line.correction import Repetition
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.sample import Sample
from tvist_plant.drives import DriveCommand
from tvist_protocol.calibration import Calibration
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
    calibration: Calibration | None
    """Calibration of the filter's modes; None for constant modes."""
    shaper: str
    """Name of the filter."""
    modes: tuple[Any, ...] = ()
    """Number and source of the modes that it suppresses."""
    basis: Any = None
    """State that plans for lessons depend on; what it is matters to those who make them alone."""

    @property
    def digest(self) -> bytes:
        """Digest of what is believed."""
        believed = (self.payload, self.calibration, self.shaper, self.modes)
        return blake2b(msgspec.json.encode(believed), digest_size=8).digest()


@dataclass(frozen=True)
class MotionRecord:
    """A motion of T ticks, of which the last ones are at rest."""

    rest: DriveCommand
    """Command under which the arm rested before it."""
    commands: Floats
    """q_r, q̇_r and τ_ff of each tick, shape (T, 3, n) [rad, rad/s, N m]."""
    q: Floats
    """Measured joint angles, shape (T, n) [rad]."""
    moments: Floats
    """Measured motor torques on the joint side, shape (T, n) [N m]."""
    accelerometer: Floats
    """Specific force in the flange frame, shape (T, 3) [m/s^2]."""
    stop: int
    """Number of ticks until the commands rested."""
    whole: bool
    """Whether it went as planned: shaped from rest to rest, without stop, stream or bypass."""
    beliefs: Beliefs
    """What the controller took the arm for."""
    repetition: Repetition | None = None
    """What tells it from other motions, and how it was corrected; None if it cannot be made again."""


@dataclass(frozen=True)
class Recorded:
    """A motion as its ticks left it: whoever studies it makes the arrays, which takes longer than a tick has."""

    rest: DriveCommand
    """See `MotionRecord`."""
    samples: Sequence[Sample]
    """Its ticks."""
    stop: int
    """See `MotionRecord`."""
    whole: bool
    """See `MotionRecord`."""
    beliefs: Beliefs
    """See `MotionRecord`."""
    repetition: Repetition | None
    """See `MotionRecord`."""

    @cached_property
    def record(self) -> MotionRecord:
        """The motion."""
        commands = [sample.command for sample in self.samples]
        measured = [sample.measured for sample in self.samples]
        return MotionRecord(
            rest=self.rest,
            commands=np.array([(one.q, one.qd, one.torque) for one in commands]),
            q=np.array([one.q for one in measured]),
            moments=np.array([one.moment for one in measured]),
            accelerometer=np.array([one.accelerometer for one in measured]),
            stop=self.stop,
            whole=self.whole,
            beliefs=self.beliefs,
            repetition=self.repetition,
        )


class MotionRecorder:
    """Records one motion after the other."""

    def __init__(self) -> None:
        self._samples: list[Sample] = []
        self._ticks, self._stop = 0, 0
        self._whole = self._moves = False
        self._rest: DriveCommand | None = None
        self._before: DriveCommand | None = None
        self._beliefs: Beliefs | None = None
        self._repetition: Repetition | None = None

    @property
    def begins(self) -> bool:
        """Whether the next tick in motion is the first one of a record, which needs to know what is believed."""
        return not self._moves or self._stop > 0

    def take(
        self, sample: Sample, beliefs: Beliefs | None = None, repetition: Repetition | None = None
    ) -> Recorded | None:
        """Take a tick.

        Args:
            sample: Signals of the tick, in which the drives hold or move the arm.
            beliefs: What the controller takes the arm for; used at the beginning of a motion only.
            repetition: The motion in progress, as far as it can be made again.

        Returns:
            The motion that is complete with this tick, or that the next one has cut short; None if there is none.
        """
        resting, done = sample.mode.at_rest, None
        if not resting and self.begins:
            done = self._finished()
            self._samples = []
            self._ticks, self._stop, self._moves, self._whole = 0, 0, True, True
            self._beliefs, self._rest = beliefs, self._before or sample.command
            self._repetition = repetition
        self._before = sample.command
        if not self._moves:
            return done
        self._whole = self._whole and (resting or sample.mode is LineMode.SHAPED)
        if not self._stop and repetition is not self._repetition:  # slowed down, or several motions in one
            self._repetition = None
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
        """Drop the present motion, since the drives do not hold the arm."""
        self._moves, self._samples, self._ticks, self._stop = False, [], 0, 0

    def begin_anew(self) -> None:
        """Drop also the last command, since the arm was placed elsewhere."""
        self.forget()
        self._before = None

    def _finished(self) -> Recorded | None:
        if not self._stop or self._stop > LONGEST or self._beliefs is None or self._rest is None:
            return None
        return Recorded(self._rest, self._samples, self._stop, self._whole, self._beliefs, self._repetition)

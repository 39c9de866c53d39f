"""Records a robot's motions, has them studied, and keeps the lessons until the arm rests."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.sample import Sample
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import FilterState
from tvist_plant.user_file import named
from tvist_protocol.lessons import PayloadLesson

LONGEST = 10_000  # longest recorded motion; longer ones are dropped [ticks]
AFTER = 150  # recording time after the end of a motion, for the ring-down [ticks]


@dataclass(frozen=True)
class MotionRecord:
    """A motion of T ticks with its ring-down."""

    q: Floats  # measured joint angles, shape (T, n) [rad]
    moments: Floats  # measured motor torques on the joint side, shape (T, n) [N m]
    stop: int  # number of ticks until the commands came to rest
    whole: bool  # whether it was a shaped motion from rest to rest, without stop, stream or bypass
    beliefs: FilterState  # state of filter and payload assumed by the controller


Record = Callable[[], MotionRecord]
"""Creates the record of a completed motion, which takes longer than a tick."""


@dataclass
class _Motion:
    beliefs: FilterState  # assumed at its start
    samples: list[Sample] = field(default_factory=list)
    stop: int = 0  # as in `MotionRecord`; 0 while it moves
    whole: bool = True


class MotionRecorder:
    """Records one motion after the other."""

    _motion: _Motion | None = None

    def take(self, sample: Sample, present: Callable[[], FilterState]) -> Record | None:
        """Take a tick with drives on; return the motion it ends, if any; `present` is called at its start."""
        resting, done, motion = sample.mode.at_rest, None, self._motion
        if not resting and (motion is None or motion.stop):
            done = None if motion is None else _recorded(motion)
            motion = self._motion = _Motion(present())
        if motion is None:
            return done
        motion.whole = motion.whole and (resting or sample.mode is LineMode.SHAPED)
        if len(motion.samples) < LONGEST + AFTER:
            motion.samples.append(sample)
        if resting and not motion.stop:
            motion.stop = len(motion.samples)
            if motion.stop > LONGEST:  # too long to teach anything: its samples take 20 MB
                self.forget()
        if motion.stop and len(motion.samples) == motion.stop + AFTER:
            done = _recorded(motion)
            self.forget()
        return done

    def forget(self) -> None:
        """Drop the present motion, because the drives are off or the arm was placed elsewhere."""
        self._motion = None


def _recorded(motion: _Motion) -> Record | None:
    """Return how to create the record of a motion at rest; None if it was too long."""
    if motion.stop > LONGEST:
        return None

    def record() -> MotionRecord:
        q = np.array([sample.measured.q for sample in motion.samples])
        moments = np.array([sample.measured.moment for sample in motion.samples])
        return MotionRecord(q, moments, motion.stop, motion.whole, motion.beliefs)

    return record


Work = Callable[[], None]  # a study; it takes a fraction of a second and touches nothing that ticks use
Later = Callable[[Work], Callable[[], bool]]
"""Starts a study outside the ticks; returns a function that tells whether it has ended."""


Study = Callable[[MotionRecord], PayloadLesson | None]
"""Returns what a motion teaches, None for nothing; called by one thread at a time. All results are in the
lessons, so a replay studies nothing."""
Plans = Callable[[PayloadLesson, FilterState], Plan]  # plans the change that a lesson requires


def at_once(work: Work) -> Callable[[], bool]:
    """Study within the tick, which may take any time with the clocks lockstep and free."""
    work()
    return lambda: True


WAITING = 16
"""Largest number of waiting studies; motions beyond, made faster than they can be studied, teach nothing."""


class LessonRecord(NamedTuple):
    """A lesson and what it depends on."""

    beliefs: FilterState  # state assumed by the controller during the motion
    lesson: PayloadLesson  # what was learnt
    plan: Plan | None  # plan for the lesson; None if not yet planned


class Experience:
    """Learning from a robot's motions, studied in order."""

    def __init__(
        self,
        study: Study,
        later: Later = at_once,  # runs a study in parallel
        plan: Plans | None = None,  # plans the changes of a lesson; None to plan in the tick that applies it
    ) -> None:
        self._recorder = MotionRecorder()
        self._study, self._later, self._plan = study, later, plan
        self._under_way: list[tuple[Callable[[], bool], list[LessonRecord]]] = []
        self._raised: list[Exception] = []
        self._said = set[str]()
        self._placements = 0

    def watch(
        self,
        sample: Sample,
        present: Callable[[], FilterState],  # the controller's assumptions about the arm
        *,
        held: bool,  # whether the drives hold the arm
        placements: int,  # number of times that the arm was placed, see `ControlCycle`
    ) -> None:
        """Take a tick."""
        if placements != self._placements or not held:
            self._placements = placements
            self._recorder.forget()
        record = self._recorder.take(sample, present) if held else None
        if record is None or len(self._under_way) >= WAITING:
            return
        learnt: list[LessonRecord] = []

        def study() -> None:
            try:
                motion = record()
                lesson = self._study(motion)
                if lesson is not None:
                    plan = None if self._plan is None else self._plan(lesson, motion.beliefs)
                    learnt.append(LessonRecord(motion.beliefs, lesson, plan))
            except Exception as error:  # noqa: BLE001  the robot goes on without the lesson, and `raised` reports it
                self._raised.append(error)

        self._under_way.append((self._later(study), learnt))

    def void(self) -> None:
        """Drop all studies in progress, because of `forget` or another load."""
        self._under_way = []

    def lessons(self) -> Iterator[LessonRecord]:
        """Yield the lessons of finished studies once; call while the arm rests."""
        while self._under_way and self._under_way[0][0]():
            yield from self._under_way.pop(0)[1]

    def raised(self) -> Sequence[Exception]:
        """Return new exceptions of studies, each message only once."""
        if not self._raised:
            return ()
        raised, self._raised = self._raised, []
        new = [error for error in raised if named(error) not in self._said]
        self._said.update(map(named, new))
        return new

"""Records the motions of a robot, has them studied, and keeps the lessons until the arm rests."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol

from tvist_controller.line.sample import Sample
from tvist_controller.safety.motion_record import Beliefs, MotionRecord, MotionRecorder
from tvist_controller.safety.payload_student import PayloadStudent
from tvist_controller.setup import Setup
from tvist_plant.user_file import named
from tvist_protocol.lessons import PayloadLesson

Work = Callable[[], None]
"""A study, which takes a fraction of a second and touches nothing that ticks use."""
Later = Callable[[Work], Callable[[], bool]]
"""Has a study made beside the ticks; returns what tells whether it has ended."""


class Student(Protocol):
    """Learns from motions.

    One thread at a time uses it. It returns all that it learns as lessons, so a replay needs no students.
    """

    def study(self, motion: MotionRecord) -> PayloadLesson | None:
        """Return what a motion teaches; None if it teaches nothing."""


def at_once(work: Work) -> Callable[[], bool]:
    """Study within the tick; with the clocks lockstep and free a tick may take as long as it likes."""
    work()
    return lambda: True


WAITING = 16
"""Studies that may wait: of motions that are made faster than studied, such as at a high speed, some teach nothing."""


class Taught(NamedTuple):
    """A lesson, and what it depends on."""

    beliefs: Beliefs
    """What the controller took the arm for during the motion."""
    lesson: PayloadLesson
    """What was learnt."""
    plan: Any
    """Plan for it; None if there is none yet."""


Planned = Callable[[PayloadLesson, Beliefs], Any]
"""Plans what a lesson changes."""


class Experience:
    """What a robot makes of its motions, each of which the students study in their order."""

    def __init__(
        self,
        students: Sequence[Student],
        later: Later = at_once,  # has a study made beside the ticks
        plan: Planned | None = None,  # of what a lesson changes; None: in the tick that takes it
    ) -> None:
        self._recorder = MotionRecorder()
        self._students, self._later, self._plan = students, later, plan
        self._under_way: list[tuple[Callable[[], bool], list[Taught]]] = []
        self._raised: list[Exception] = []
        self._said = set[str]()
        self._placements = 0

    def watch(
        self,
        sample: Sample,
        beliefs: Callable[[], Beliefs],  # what the controller takes the arm for
        *,
        held: bool,  # whether the drives hold the arm
        placements: int,  # number of times that the arm was put somewhere, see `ControlCycle`
    ) -> None:
        """Take a tick."""
        recorder = self._recorder
        if placements != self._placements or not held:
            self._placements = placements
            recorder.forget()
        if not held:
            return
        known = beliefs() if recorder.begins and not sample.mode.at_rest else None
        record = recorder.take(sample, known)
        if record is None or len(self._under_way) >= WAITING:
            return
        for student in self._students:
            learnt: list[Taught] = []

            def study(student: Student = student, learnt: list[Taught] = learnt) -> None:
                try:
                    motion = record()
                    lesson = student.study(motion)
                    if lesson is not None:
                        plan = None if self._plan is None else self._plan(lesson, motion.beliefs)
                        learnt.append(Taught(motion.beliefs, lesson, plan))
                except Exception as error:  # noqa: BLE001  a robot goes on without the lesson, and says so
                    self._raised.append(error)

            self._under_way.append((self._later(study), learnt))

    def void(self) -> None:
        """Drop what is being learnt of motions so far, since it is to be forgotten, or the arm carries another load."""
        self._under_way = []

    def lessons(self) -> Iterator[Taught]:
        """Yield the lessons of all finished studies, once; to be asked while the arm rests."""
        while self._under_way and self._under_way[0][0]():
            yield from self._under_way.pop(0)[1]

    def raised(self) -> Sequence[Exception]:
        """Return what studies have raised, once, and not the same with every motion."""
        if not self._raised:
            return ()
        raised, self._raised = self._raised, []
        new = [error for error in raised if named(error) not in self._said]
        self._said.update(map(named, new))
        return new


def experience_of(
    setup: Setup, students: Sequence[Student] = (), later: Later = at_once, plan: Planned | None = None
) -> Experience | None:
    """Return what a robot makes of its motions, with further students; None if nobody studies them."""
    own = [PayloadStudent(setup.description)] if setup.adapt == "payload" else []
    everyone = [*own, *students]
    return Experience(everyone, later, plan) if everyone else None

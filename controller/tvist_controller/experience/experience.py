"""Records the motions of a robot, has them studied, and keeps the lessons until the arm rests."""

from collections.abc import Callable, Sequence

from tvist_controller.experience.lesson import Later, Student, Work
from tvist_controller.experience.motion_record import Beliefs, MotionRecorder
from tvist_controller.line.correction import Repetition
from tvist_controller.line.sample import Sample
from tvist_protocol.lessons import Lesson


def at_once(work: Work) -> Callable[[], bool]:
    """Study within the tick; with the clocks lockstep and free a tick may take as long as it likes."""
    work()
    return lambda: True


class Experience:
    """What a robot makes of its motions.

    Args:
        joints: Number of joints.
        students: Who studies each motion, in this order.
        later: Has a study made beside the ticks.
    """

    def __init__(self, joints: int, students: Sequence[Student], later: Later = at_once) -> None:
        self._recorder = MotionRecorder(joints)
        self._students, self._later = students, later
        self._under_way: list[tuple[Callable[[], bool], list[Lesson]]] = []
        self._raised: list[Exception] = []

    def watch(
        self,
        sample: Sample,
        beliefs: Callable[[], Beliefs],
        repetition: Repetition | None = None,
        *,
        held: bool,
    ) -> None:
        """Take a tick.

        Args:
            sample: Its signals.
            beliefs: Returns what the controller takes the arm for.
            repetition: The motion in progress, as far as it can be made again.
            held: Whether the drives hold the arm.
        """
        recorder = self._recorder
        if not held:
            recorder.forget()
            return
        known = beliefs() if recorder.begins and not sample.mode.at_rest else None
        motion = recorder.take(sample, known, repetition)
        if motion is None:
            return
        for student in self._students:
            learnt: list[Lesson] = []

            def study(student: Student = student, learnt: list[Lesson] = learnt) -> None:
                try:
                    lesson = student.study(motion)
                except Exception as error:  # noqa: BLE001  a robot goes on without the lesson, and says so
                    self._raised.append(error)
                    return
                if lesson is not None:
                    learnt.append(lesson)

            self._under_way.append((self._later(study), learnt))

    def lessons(self) -> Sequence[Lesson]:
        """Return the lessons of all finished studies, once; to be asked while the arm rests."""
        if not self._under_way:
            return ()
        found: list[Lesson] = []
        while self._under_way and self._under_way[0][0]():
            found += self._under_way.pop(0)[1]
        return found

    def raised(self) -> Sequence[Exception]:
        """Return what studies have raised, once."""
        if not self._raised:
            return ()
        raised, self._raised = self._raised, []
        return raised

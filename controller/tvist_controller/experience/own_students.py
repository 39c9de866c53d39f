"""Who studies a robot's motions because its setup asks for it."""

from collections.abc import Sequence

from tvist_controller.experience.experience import Experience, Planned, at_once
from tvist_controller.experience.lesson import Later, Student
from tvist_controller.experience.payload_student import PayloadStudent
from tvist_controller.setup import Setup


def experience_of(
    setup: Setup, students: Sequence[Student] = (), later: Later = at_once, plan: Planned | None = None
) -> Experience | None:
    """Return what a robot makes of its motions; None if nobody studies them.

    Args:
        setup: The robot's setup.
        students: Who studies them besides those that the setup asks for.
        later: Has a study made beside the ticks.
        plan: Plans what a lesson changes, see `Experience`.
    """
    own = [PayloadStudent(setup.description)] if setup.adapt == "payload" else []
    everyone = [*own, *students]
    return Experience(everyone, later, plan) if everyone else None

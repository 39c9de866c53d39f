"""Who studies motions, and what a lesson is."""

from collections.abc import Callable
from typing import Protocol

from tvist_controller.experience.motion_record import MotionRecord
from tvist_protocol.lessons import PayloadLesson

Work = Callable[[], None]
"""A study, which takes a fraction of a second and touches nothing that ticks use."""
Later = Callable[[Work], Callable[[], bool]]
"""Has a study made beside the ticks; returns what tells whether it has ended."""


class Student(Protocol):
    """Learns from motions.

    One thread at a time uses it. What it learns is told by lessons alone, so that a replay needs no students.
    """

    def study(self, motion: MotionRecord) -> PayloadLesson | None:
        """Return what a motion teaches; None if it teaches nothing."""

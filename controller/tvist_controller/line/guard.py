"""What the control line asks before it plays a reference of a guarded motion."""

from typing import NamedTuple, Protocol

from tvist_controller.line.differentiator import Target
from tvist_controller.trajectory import JointStop
from tvist_protocol.replies import Code


class Obstacle(NamedTuple):
    """Why a reference was refused."""

    why: str
    """The reason, for people."""
    code: Code
    """The reason, for programs."""


class Guard(Protocol):
    """Decides whether a shaped reference may be played, and knows a stop that may be made instead."""

    obstacle: Obstacle
    """Why the latest reference was refused."""

    def __call__(self, state: Target) -> JointStop | None:
        """Return the stop from the previous state to make instead of a reference that must not be played."""

    def give_up(self, why: str) -> JointStop:
        """Return the stop from the previous state, since no reference follows for this reason."""

    def fallback(self) -> JointStop:
        """Return the stop from the state of the last reference played, which is known to be clear."""

    def clear(self, stop: JointStop) -> bool:
        """Return whether the whole way of a stop is clear."""

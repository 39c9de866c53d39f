"""Interface by which the control line checks references of a guarded motion."""

from typing import NamedTuple, Protocol

from tvist_controller.line.differentiator import Target
from tvist_controller.trajectory import JointStop
from tvist_protocol.replies import Code


class Obstacle(NamedTuple):
    """Reason for refusing a reference."""

    why: str  # reason for users
    code: Code  # reason for programs


class Guard(Protocol):
    """Decides whether a shaped reference may be played, and supplies the stop otherwise."""

    obstacle: Obstacle  # reason for refusing the latest reference

    def __call__(self, state: Target) -> JointStop | None:
        """Return the stop to use if a reference that leads to this state must not be played, else None."""

    def give_up(self, why: str) -> JointStop:
        """Return the stop from the previous state, because no reference follows for this reason."""

    def fallback(self) -> JointStop:
        """Return the clear stop from the state of the last reference played."""

    def clear(self, stop: JointStop) -> bool:
        """Return whether a whole stop is clear."""

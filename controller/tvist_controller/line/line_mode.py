"""Table of the control line's modes (active parts, permitted next modes), and the guard some modes need."""

from enum import Enum
from typing import NamedTuple, Protocol

from tvist_controller.line.differentiator import Target
from tvist_controller.trajectory import JointStop
from tvist_protocol.replies import Code


class LineMode(Enum):
    """Mode of the control line; a member's values are `shaped`, `guarded`, and the permitted next modes."""

    REST = (True, False, "REST", "SHAPED", "GUARDED", "BYPASSED")  # the shaped reference rests
    SHAPED = (True, False, "REST", "SHAPED", "BYPASSED", "RUNNING_OUT", "STOPPING")  # a shaped planned motion
    GUARDED = (True, True, "REST", "GUARDED", "BYPASSED", "STOPPING")  # a shaped stream or guided motion
    BYPASSED = (False, True, "REST", "BYPASSED", "STOPPING")  # an unshaped guided motion
    RUNNING_OUT = (True, False, "REST", "STOPPING")
    """A planned motion that continues to its end, which is sooner than any stop."""
    STOPPING = (False, False, "REST", "STOPPING")  # an unshaped stop

    def __init__(self, shaped: bool, guarded: bool, *followed_by: str) -> None:
        self.at_rest = self.name == "REST"
        self.shaped = shaped
        """Whether references pass the filter; otherwise they are played as they are, and the delay line is dropped."""
        self.guarded = guarded
        """Whether a shaped reference is played only if a collision-free stop exists from it."""
        self.followed_by = followed_by


def check_change(before: LineMode, after: LineMode, *, guarded: bool) -> None:
    """Raise ValueError if the table forbids this change, or if the new mode needs a guard and has none."""
    if after.name not in before.followed_by:
        raise ValueError(f"the line cannot change from {before.name} to {after.name}")
    if after.guarded and not guarded:
        raise ValueError(f"mode {after.name} of the line needs a guard")


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

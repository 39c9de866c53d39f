"""What the control line does, as a table: which of its parts are at work in each mode, and which mode may follow."""

from enum import Enum


class LineMode(Enum):
    """Mode of the control line.

    A row has `shaped`, `guarded`, and the names of the modes that may follow.
    """

    REST = (True, False, "REST", "SHAPED", "GUARDED", "BYPASSED")
    """The shaped reference rests."""
    SHAPED = (True, False, "REST", "SHAPED", "BYPASSED", "RUNNING_OUT", "STOPPING")
    """A planned motion, shaped."""
    GUARDED = (True, True, "REST", "GUARDED", "BYPASSED", "STOPPING")
    """A stream or a guided motion, shaped."""
    BYPASSED = (False, True, "REST", "BYPASSED", "STOPPING")
    """A guided motion, not shaped."""
    RUNNING_OUT = (True, False, "REST", "STOPPING")
    """A planned motion that goes on, since it ends sooner than any stop."""
    STOPPING = (False, False, "REST", "STOPPING")
    """A stop, not shaped."""

    def __init__(self, shaped: bool, guarded: bool, *followed_by: str) -> None:
        self.at_rest = self.name == "REST"
        """Whether the shaped reference rests."""
        self.shaped = shaped
        """Whether references go through the filter; else they are the shaped ones, and its delay line is dropped."""
        self.guarded = guarded
        """Whether each shaped reference is played only if the arm could still stop from it without a collision."""
        self.followed_by = followed_by
        """Names of the modes that may begin while it lasts."""


def check_change(before: LineMode, after: LineMode, *, guarded: bool) -> None:
    """Check that a mode may follow another one.

    Raises:
        ValueError: The table does not have this change, or the mode needs a guard.
    """
    if after.name not in before.followed_by:
        raise ValueError(f"the line cannot change from {before.name} to {after.name}")
    if after.guarded and not guarded:
        raise ValueError(f"mode {after.name} of the line needs a guard")

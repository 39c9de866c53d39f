"""What the control line does, as a table: which of its parts are at work in each mode, and which mode may follow."""

from enum import Enum


class LineMode(Enum):
    """Mode of the control line.

    A row has `label`, `shaped`, `guarded`, and the names of the modes that may follow.
    """

    REST = (
        "the shaped reference rests",
        True, False, "REST", "SHAPED", "GUARDED", "BYPASSED",
    )  # fmt: skip
    SHAPED = (
        "a planned motion, shaped",
        True, False, "REST", "SHAPED", "BYPASSED", "RUNNING_OUT", "STOPPING",
    )  # fmt: skip
    GUARDED = (
        "a stream or a guided motion, shaped",
        True, True, "REST", "GUARDED", "BYPASSED", "STOPPING",
    )  # fmt: skip
    BYPASSED = (
        "a guided motion, not shaped",
        False, True, "REST", "BYPASSED", "STOPPING",
    )  # fmt: skip
    RUNNING_OUT = (
        "a planned motion that goes on, since it ends sooner than any stop",
        True, False, "REST", "STOPPING",
    )  # fmt: skip
    STOPPING = (
        "a stop, not shaped",
        False, False, "REST", "STOPPING",
    )  # fmt: skip

    def __init__(self, label: str, shaped: bool, guarded: bool, *followed_by: str) -> None:
        self.at_rest = self.name == "REST"
        """Whether the shaped reference rests."""
        self.label = label
        """The mode in words."""
        self.shaped = shaped
        """Whether references go through the filter; else they are the shaped ones, and its delay line is dropped."""
        self.guarded = guarded
        """Whether each shaped reference is played only if the arm could still stop from it without a collision."""
        self.followed_by = followed_by
        """Names of the modes that may begin while it lasts."""


def check_change(before: LineMode, after: LineMode, *, guarded: bool) -> None:
    """Check that a mode may follow another one.

    Args:
        before: Present mode.
        after: Next mode.
        guarded: Whether there is a guard.

    Raises:
        ValueError: The table does not have this change, or the mode needs a guard.
    """
    if after.name not in before.followed_by:
        raise ValueError(f"the line cannot change from {before.name} to {after.name}")
    if after.guarded and not guarded:
        raise ValueError(f"mode {after.name} of the line needs a guard")


def diagram() -> str:
    """Return the table as a Mermaid state diagram; changes back to the same mode are left out."""
    rows = [f"    {mode.name}: {mode.name}<br>{mode.label}" for mode in LineMode]
    rows += [
        f"    {mode.name} --> {after}"
        for mode in LineMode
        for after in mode.followed_by
        if after != mode.name
    ]
    return "\n".join(("```mermaid", "stateDiagram-v2", *rows, "```"))

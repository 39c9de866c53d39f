"""The threads of a running program."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from typing import Any

MOST_THREADS = 100  # most threads of a program at the same time


@dataclass(eq=False)
class Thread:
    """A thread of a script."""

    number: int  # 0 for the main thread; numbers are never reused
    steps: Generator[Any, None, Any] | None  # runs it; None when it has ended
    parent: "Thread | None"  # the thread that started it, or that one's nearest living ancestor
    critical: int = 0  # number of critical sections it is in
    spent: int = 0  # evaluations since it waited for time to pass or received something from outside
    owes: int = 0  # evaluations of its first statements in its next turn, charged to that tick
    joins: "Thread | None" = None  # the thread for whose end it waits
    added: bool = False  # whether it belongs to added statements, or as the main thread runs them now

    @property
    def ended(self) -> bool:
        """Whether the thread has ended or was killed."""
        return self.steps is None

    def descends_from(self, other: "Thread") -> bool:
        """Return whether this thread is the other one or one of its descendants."""
        thread: Thread | None = self
        while thread is not None:
            if thread is other:
                return True
            thread = thread.parent
        return False

    def leave(self, others: "Iterable[Thread]") -> None:
        """Mark the thread as ended, and hand the threads that it started to its parent.

        `kill` of the parent thus still reaches them, and the ended thread need not be kept.
        """
        self.steps = None
        for other in others:
            if other.parent is self:
                other.parent = self.parent

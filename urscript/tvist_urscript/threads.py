"""The threads of a running program."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from typing import Any

MOST_THREADS = 100
"""Most threads of a program at the same time."""


@dataclass(eq=False)
class Thread:
    """A thread of a script.

    Attributes:
        number: 0 for the main thread; others count on, and a number never comes again.
        steps: The generator that runs it, None when it has ended.
        parent: The thread that has started it, or the nearest thread before that which has not ended; None for the main
            thread.
        critical: How many critical sections it is in.
        spent: Evaluations since it has waited for time to pass, or has got something from outside.
        owes: Evaluations of what it does first in its next turn, which that tick has to bear.
        joins: The thread for whose end it waits.
        added: Whether it was started by statements that were added to the program, or is the main thread and runs such
            statements now.
    """

    number: int
    steps: Generator[Any, None, Any] | None
    parent: "Thread | None"
    critical: int = 0
    spent: int = 0
    owes: int = 0
    joins: "Thread | None" = None
    added: bool = False

    @property
    def ended(self) -> bool:
        """Whether the thread has come to its end, or was killed."""
        return self.steps is None

    def descends_from(self, other: "Thread") -> bool:
        """Return whether this thread is the other, or was started by it, directly or by threads in between."""
        thread: Thread | None = self
        while thread is not None:
            if thread is other:
                return True
            thread = thread.parent
        return False

    def leave(self, others: "Iterable[Thread]") -> None:
        """Mark the thread as ended, and make its parent the parent of the threads that it has started.

        So `kill` of the parent still reaches them, and the ended thread need not be kept.
        """
        self.steps = None
        for other in others:
            if other.parent is self:
                other.parent = self.parent

"""The threads of a running program."""

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

MOST_THREADS = 100
"""Threads of a program at the same time."""


@dataclass(eq=False)
class Thread:
    """A thread of a script.

    Attributes:
        number: 0 for the main thread; others count on, and a number never comes again.
        steps: The generator that runs it.
        parent: The thread that has started it, None for the main thread.
        critical: How many critical sections it is in.
        spent: Ticks one after the other in which it used up its budget.
        ended: It has come to its end, or was killed.
    """

    number: int
    steps: Generator[Any, None, Any]
    parent: "Thread | None"
    critical: int = 0
    spent: int = 0
    ended: bool = field(default=False)

    def descends_from(self, other: "Thread") -> bool:
        """Whether the other has started it, or one of those that have."""
        thread: Thread | None = self
        while thread is not None:
            if thread is other:
                return True
            thread = thread.parent
        return False

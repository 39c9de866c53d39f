"""The threads of a running program."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from typing import Any

MOST_THREADS = 100  # most threads of a program at the same time


class Halted(Exception):  # noqa: N818  no error: the script has executed `halt`
    """Raised by `halt` to unwind the running thread; the machine then ends all threads."""


class Killed(Exception):  # noqa: N818  no error: the script has killed the thread that runs
    """Raised to unwind the running thread if this thread has killed itself or one of its ancestors."""


def halt() -> None:
    """End all threads of the program."""
    raise Halted


@dataclass(eq=False)
class Thread:
    """A thread of a script."""

    number: int  # 0 for the main thread; numbers are never reused
    steps: Generator[Any, None, Any] | None  # runs the thread; None when it has ended
    parent: "Thread | None"  # thread that started it or, if that has ended, its nearest living ancestor
    critical: int = 0  # number of critical sections that it has entered
    spent: int = 0  # evaluations since it last waited for a tick or received something
    owes: int = 0  # evaluations of the statements that begin its next turn, charged then
    joins: "Thread | None" = None  # the thread for whose end it waits
    added: bool = False  # whether added statements have started it, or it is the main thread running them

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
        """Mark the thread as ended; its parent becomes the parent of the threads that it started.

        So killing the parent still ends them, and the ended thread need not be kept.
        """
        self.steps = None
        for other in others:
            if other.parent is self:
                other.parent = self.parent


class CriticalSection:
    """The critical section of a program. Its holder keeps it until the holder leaves or waits for a tick."""

    def __init__(self) -> None:
        self._holder: Thread | None = None

    def admits(self, thread: Thread) -> bool:
        """Return whether a thread may run; a thread inside takes the section if that is free."""
        if thread.critical and self._holder is None:
            self._holder = thread
        return not thread.critical or self._holder is thread

    def taken_from(self, thread: Thread) -> bool:
        """Return whether another thread holds the section."""
        return self._holder is not None and self._holder is not thread

    def enter(self, thread: Thread) -> bool:
        """Put a thread inside the section; return whether the thread may continue."""
        thread.critical += 1
        return self.admits(thread)

    def leave(self, thread: Thread) -> None:
        """Undo one `enter` of a thread."""
        thread.critical = max(thread.critical - 1, 0)
        if not thread.critical:
            self.release(thread)

    def release(self, thread: Thread) -> None:
        """If this thread holds the section, let other threads take it."""
        if self._holder is thread:
            self._holder = None

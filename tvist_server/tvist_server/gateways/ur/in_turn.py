"""What one client has asked for, done in its order."""

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")
Done = Callable[[], None]
"""To be called once, when an item is done."""


class InTurn(Generic[Item]):
    """Does one item after the other: the next begins when the previous one is done.

    Args:
        begin: Begins an item.
        idle: Called when none is left.
    """

    def __init__(self, begin: Callable[[Item, Done], None], idle: Callable[[], None] | None = None) -> None:
        self._begin, self._idle = begin, idle
        self._items: deque[Item] = deque()
        self._begun = self._ended = 0
        """Number of items begun, and done."""
        self._working = False

    @property
    def waiting(self) -> int:
        """Number of items that are not done."""
        return len(self._items) + self._begun - self._ended

    def add(self, item: Item) -> None:
        """Do an item in its turn."""
        self._items.append(item)
        self._work()

    def drop(self) -> None:
        """Drop the items that have not begun."""
        self._items.clear()

    def _work(self) -> None:
        """Do the items, until one has to wait for its end."""
        if self._working:
            return
        self._working = True
        while self._items and self._begun == self._ended:
            self._begun += 1
            self._begin(self._items.popleft(), self._done)
        self._working = False
        if self._idle is not None and not self.waiting:
            self._idle()

    def _done(self) -> None:
        self._ended += 1
        self._work()

"""Notices about the interfaces' clients on the server's console, limited so that no client can flood it."""

import asyncio
from collections.abc import Callable
from typing import Final

EVERY: Final = 1.0
"""Time between two lines [s]."""


class Notices:
    """Says at most one line a second, however many there are to say.

    The first line is said at once. Of those that follow within a second the newest is said when the second is
    over, with the number of the others, which are left out. All methods are called in the event loop's thread.

    Args:
        say: Takes a line, without its line feed.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._newest = ""
        self._waiting = 0
        self._pause: asyncio.TimerHandle | None = None

    def tell(self, line: str) -> None:
        """Say a line, now or when its turn has come."""
        if self._pause is not None:
            self._newest = line
            self._waiting += 1
            return
        self._say(line)
        self._pause = asyncio.get_running_loop().call_later(EVERY, self._go_on)

    def flush(self) -> None:
        """Say what waits, at the end: no timer will."""
        if self._pause is not None:
            self._pause.cancel()
            self._pause = None
        if self._waiting:
            self._say(self._summary())

    def _go_on(self) -> None:
        self._pause = None
        if self._waiting:
            self.tell(self._summary())

    def _summary(self) -> str:
        others, self._waiting = self._waiting - 1, 0
        return f"{self._newest} (not shown since the last line: {others})" if others else self._newest

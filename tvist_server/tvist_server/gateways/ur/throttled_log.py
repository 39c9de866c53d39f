"""ThrottledLog about the interfaces' clients on the server's console, limited so that no client can flood it."""

import asyncio
from collections.abc import Callable
from typing import Final

LINE_INTERVAL: Final = 1.0  # time between two lines [s]


class ThrottledLog:
    """Passes at most one line a second to `say`, with the number of omitted lines; for the event loop's thread."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._newest = ""
        self._waiting = 0
        self._pause: asyncio.TimerHandle | None = None

    def tell(self, line: str) -> None:
        """Write a line now, or when a second has passed since the last one."""
        if self._pause is not None:
            self._newest = line
            self._waiting += 1
            return
        self._say(line)
        self._pause = asyncio.get_running_loop().call_later(LINE_INTERVAL, self._go_on)

    def flush(self) -> None:
        """Write the waiting line at shutdown, when no timer will."""
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

"""Stops and warnings for the person at the server's console, one line each, on the log."""

import logging
import threading
import time
from collections.abc import Callable, Collection, Sequence
from queue import SimpleQueue

from tvist_controller.instruments.report import Topic
from tvist_protocol.errors import harmless
from tvist_protocol.stream import Event, EventKind
from tvist_server.gateways.base import Gateway, Message

log = logging.getLogger(__name__)

WINDOW = 10.0  # window in which lines are counted [s]
STOPS, WARNINGS = 10, 5  # largest number of lines of each kind per window; warnings never displace stops
LEAVE = 0.2  # longest wait at shutdown for a blocked console [s]


class Throttle:
    """Passes at most `lines` lines per `WINDOW` and counts omitted ones; `what` names them in the count."""

    def __init__(self, lines: int, what: str) -> None:
        self._lines, self._what = lines, what
        self._began: float | None = None
        self._said = self._left_out = 0

    def take(self, line: str, now: float) -> list[str]:
        """Take a new line at the time `now` of a monotonic clock [s]; return the lines to write."""
        lines = self.due(now)
        if self._began is None:
            self._began = now
        if self._said < self._lines:
            self._said += 1
            return [*lines, line]
        self._left_out += 1
        return lines

    def due(self, now: float) -> list[str]:
        """Return the line that counts the omitted lines, if the window is over and there are any."""
        return [] if self._began is None or now - self._began < WINDOW else self.rest()

    def rest(self) -> list[str]:
        """End the window now, and return the line that counts the omitted lines, if there are any."""
        left_out, self._began = self._left_out, None
        self._said = self._left_out = 0
        return [f"{left_out} more {self._what} in the last {WINDOW:g} s, left out here"] if left_out else []


class Console:
    """Writes lines to the log from its own thread, since a console that nobody reads blocks the writer."""

    def __init__(self) -> None:
        self._throttles = {"stop": Throttle(STOPS, "stops"), "warning": Throttle(WARNINGS, "warnings")}
        self._lock = threading.Lock()
        self._queue: SimpleQueue[str | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="tvist-console", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def say(self, line: str, *, stop: bool) -> None:
        """Write a line about a stop or a warning, unless the limit is reached."""
        with self._lock:
            self._put(self._throttles["stop" if stop else "warning"].take(line, time.monotonic()))

    def update(self) -> None:
        """Write the number of omitted lines when it is due; call this regularly."""
        with self._lock:
            for throttle in self._throttles.values():
                self._put(throttle.due(time.monotonic()))

    def close(self) -> None:
        """Write the remaining lines; give up after `LEAVE` if the console blocks."""
        with self._lock:
            for throttle in self._throttles.values():
                self._put(throttle.rest())
        self._queue.put(None)
        if self._thread.is_alive():
            self._thread.join(LEAVE)

    def _put(self, lines: Sequence[str]) -> None:
        for line in lines:
            self._queue.put(line)

    def _write(self) -> None:
        while (line := self._queue.get()) is not None:
            log.warning("%s", harmless(line))


class ConsoleGateway(Gateway):
    """Passes events of robot `name` to the console; `command_line` returns a command line for this robot."""

    wanted_topics: Collection[Topic] = frozenset[Topic]({"event"})

    def __init__(self, console: Console, name: str, command_line: Callable[[str], str]) -> None:
        self._console, self._name, self._command_line = console, name, command_line

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  every gateway gets it
        if not isinstance(message, Event) or message.kind not in _TOLD:
            return
        stop = message.kind != "warning"
        # After other stops the next step depends on what has happened since; `tvist check` reports it.
        command = {"protective_stop": "unlock", "safety_stop": "check"}.get(message.kind)
        then = "" if command is None else f". Next: {self._command_line(command)}"
        what = _TOLD[message.kind]
        self._console.say(f"{self._name}: {what} at tick {message.tick}: {message.why}{then}", stop=stop)


_TOLD: dict[EventKind, str] = {
    "protective_stop": "protective stop",
    "safety_stop": "safety stop",
    "warning": "warning",
}

"""What a person at the server's console has to know: stops and warnings, a line each, on the log."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from queue import SimpleQueue

from tvist_controller.sink import Topic
from tvist_protocol.stream import Event, EventKind
from tvist_server.gateways.base import Gateway, Message

log = logging.getLogger(__name__)

WINDOW = 10.0
"""Time in which lines are counted [s]."""
STOPS, WARNINGS = 10, 5
"""Lines of each kind in that time; warnings never take the room of stops."""
LEAVE = 0.2
"""How long the end waits for a console that nobody reads [s]."""


class Throttle:
    """Lets through so many lines in a time, and counts the rest. Without a clock of its own.

    Args:
        lines: How many, in `WINDOW`.
        what: What they are, for the line that says how many were left out.
    """

    def __init__(self, lines: int, what: str) -> None:
        self._lines, self._what = lines, what
        self._began: float | None = None
        self._said = self._left_out = 0

    def take(self, line: str, now: float) -> list[str]:
        """What to say where there is one more line.

        Args:
            line: The line.
            now: On any clock that goes forward [s].
        """
        lines = self.due(now)
        if self._began is None:
            self._began = now
        if self._said < self._lines:
            self._said += 1
            return [*lines, line]
        self._left_out += 1
        return lines

    def due(self, now: float) -> list[str]:
        """What to say once the time is over: how many lines were left out, if any were."""
        return [] if self._began is None or now - self._began < WINDOW else self.rest()

    def rest(self) -> list[str]:
        """The same at once."""
        left_out, self._began = self._left_out, None
        self._said = self._left_out = 0
        return [f"{left_out} more {self._what} in the last {WINDOW:g} s, left out here"] if left_out else []


class Console:
    """Writes lines on the log from a thread of its own, since a console that nobody reads makes its writer wait."""

    def __init__(self) -> None:
        self._throttles = {"stop": Throttle(STOPS, "stops"), "warning": Throttle(WARNINGS, "warnings")}
        self._lock = threading.Lock()
        self._queue: SimpleQueue[str | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="tvist-console", daemon=True)

    def start(self) -> None:
        """Begin to write; what was said before waits."""
        self._thread.start()

    def say(self, line: str, *, stop: bool) -> None:
        """Write a line, unless there were too many.

        Args:
            line: The line.
            stop: Whether it is about a stop, not a warning.
        """
        with self._lock:
            self._put(self._throttles["stop" if stop else "warning"].take(line, time.monotonic()))

    def update(self) -> None:
        """Say how many lines were left out, where it is time to: to be called now and then."""
        with self._lock:
            for throttle in self._throttles.values():
                self._put(throttle.due(time.monotonic()))

    def close(self) -> None:
        """Say what is left to be said, as far as somebody reads it."""
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
            log.warning("%s", line)


class ConsoleGateway(Gateway):
    """The way of one robot's events to the console. Nothing comes in here.

    Args:
        console: Where they go.
        name: The robot's.
        command_line: What to type for a command to reach it.
    """

    setpoints_refused = 0

    def __init__(self, console: Console, name: str, command_line: Callable[[str], str]) -> None:
        self._console, self._name, self._command_line = console, name, command_line

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  every gateway gets it
        """Say it where it is for a person."""
        if not isinstance(message, Event) or message.kind not in _TOLD:
            return
        stop = message.kind != "warning"
        # After other stops it depends on what has happened since: check says.
        command = {"protective_stop": "unlock", "safety_stop": "check"}.get(message.kind)
        then = "" if command is None else f". Next: {self._command_line(command)}"
        what = _TOLD[message.kind]
        self._console.say(f"{self._name}: {what} at tick {message.tick}: {message.why}{then}", stop=stop)

    def close(self) -> None:
        """Do nothing: the console is several robots'."""


_TOLD: dict[EventKind, str] = {
    "protective_stop": "protective stop",
    "safety_stop": "safety stop",
    "warning": "warning",
}

"""The recorder: takes messages from the tick without making it wait, writes them in a thread of its own."""

import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Event as Flag
from threading import Thread, current_thread
from types import TracebackType
from typing import Any, Self

import msgspec

from tvist_controller.sink import Sink
from tvist_protocol.errors import TvistError
from tvist_protocol.info import Info
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import Recorded, topics
from tvist_protocol.stream import Event, State, Truth
from tvist_server.recording.whereabouts import DeletedError, whereabouts
from tvist_server.recording.writer import RecordingWriter, heading

QUEUE_SIZE = 8192
"""Messages that may wait. State, truth and a set-point every tick are 1500 a second: five seconds of a
disk that does not answer, the time a file system takes to commit, in about 30 MB."""
PAUSE = 0.02
"""Time between two looks into the queue [s]. Nobody wakes the writer: that would cost the tick a system
call, and the interpreter's lock in the middle of its work."""
LOOK = 1.0
"""Time between two looks whether the file is still where it was [s]."""


class RecorderError(TvistError):
    """A recording cannot be begun."""


class Recorder(Sink):
    """Records one robot until it is closed.

    Messages come from one thread; they are not copied, and must not be changed afterwards. Without `wait`, no
    method but `close` blocks, and none raises: what finds the queue full or the recording stopped is dropped
    and counted.

    Args:
        path: The file.
        info: The robot.
        start: How the server was started: all that a replay needs besides the journal, as JSON knows it.
        overwrite: Whether a file of that name may be replaced.
        queue_size: Messages that may wait for the writer.
        wait: Whether a full queue is waited for: for a robot whose time waits too, in lockstep and free.
        on_error: Called once, from the writer's thread, with a sentence when the recording has stopped by
            itself: the disk is full, or the file was deleted.
        on_moved: Called once, from the writer's thread, with a sentence when the file was moved away. The recording
            goes on in it, wherever it is.

    Raises:
        RecordingError: The file exists, cannot be written, or `start` cannot.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        info: Info,
        start: Mapping[str, Any],
        *,
        overwrite: bool = False,
        queue_size: int = QUEUE_SIZE,
        wait: bool = False,
        on_error: Callable[[str], None] | None = None,
        on_moved: Callable[[str], None] | None = None,
    ) -> None:
        if queue_size < 1:
            raise RecorderError(f"queue_size is {queue_size}: must be at least 1")
        self.path = Path(path)
        self.place: Path | None = self.path
        """Place of the file, as far as is known: `path`, unless it was moved away. After `close` it is where it was
        at the end."""
        self.error: str | None = None
        """Why the recording stopped by itself, as a sentence."""
        self._dropped: dict[type[msgspec.Struct], int] = dict.fromkeys((State, Event, Truth, Entry), 0)
        self._queue: deque[Recorded] = deque()
        self._queue_size = queue_size
        self._wait = wait
        self._on_error = on_error
        self._on_moved = on_moved
        self._stopped = False
        self._closing = False
        self._wake = Flag()
        self._room = Flag()
        self._begin(info, start, overwrite)
        # A daemon: a program that ends without closing is not kept from it, and its file can be read.
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def state(self, state: State) -> None:
        """Record one tick."""
        self._offer(state)

    def event(self, event: Event) -> None:
        """Record an event."""
        self._offer(event)

    def truth(self, truth: Truth) -> None:
        """Record one tick of what no robot can know."""
        self._offer(truth)

    def journal(self, entry: Entry) -> None:
        """Record what reached the controller."""
        self._offer(entry)

    @property
    def dropped(self) -> int:
        """Messages that were not recorded since the queue was full or the recording had stopped."""
        return sum(self._dropped.values())

    def close(self) -> None:
        """Write what waits and the index, and end the thread. Closing again does nothing."""
        self._stopped = True
        self._closing = True
        self._wake.set()
        if current_thread() is not self._thread:
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _offer(self, message: Recorded) -> None:
        if self._wait and len(self._queue) >= self._queue_size:
            self._wait_for_room()
        if self._stopped or len(self._queue) >= self._queue_size:
            self._dropped[type(message)] += 1
        else:
            self._queue.append(message)

    def _wait_for_room(self) -> None:
        self._room.clear()
        self._wake.set()
        while len(self._queue) >= self._queue_size and not self._stopped:
            self._room.wait(PAUSE)

    def _begin(self, info: Info, start: Mapping[str, Any], overwrite: bool) -> None:
        try:
            topic_of, first = topics(info.name), heading(info, start)
        except (TypeError, ValueError, TvistError) as error:
            raise RecorderError(f"{self.path} cannot be started: {error}") from error
        try:
            self._stream = self.path.open("wb" if overwrite else "xb")
        except FileExistsError:
            raise RecorderError(
                f"{self.path} exists already and is not overwritten: choose another file"
            ) from None
        except OSError as error:
            raise RecorderError(f"{self.path} cannot be written: {_reason(error)}") from error
        try:
            self._writer = RecordingWriter(self._stream, topic_of, first)
        except OSError as error:
            self._abandon()
            raise RecorderError(f"{self.path} cannot be written: {_reason(error)}") from error

    def _run(self) -> None:
        try:
            looked = time.monotonic()
            while not self._closing:
                self._wake.wait(PAUSE)
                self._wake.clear()
                self._drain()
                if time.monotonic() - looked >= LOOK:
                    self._look()
                    looked = time.monotonic()
            self._drain()
            self._writer.finish(self._dropped)
            self._look()
            self._stream.close()
        except DeletedError:
            self._stop(
                f"the recording {self.path} was deleted, or moved to another file system, where it ends: "
                "no more is recorded"
            )
        except Exception as error:  # noqa: BLE001  a thread has nobody above it: whatever it was must be told
            self._stop(f"the recording {self.path} has stopped and is incomplete: {_reason(error)}")

    def _look(self) -> None:
        """Say once that the file was moved away.

        Raises:
            DeletedError: It was deleted: to go on would fill the disk with what nobody can read.
        """
        self.place = whereabouts(self.path, self._stream.fileno())
        if self.place != self.path and self._on_moved is not None:
            where = "it continues in that file" if self.place is None else f"it continues in {self.place}"
            self._on_moved(f"the recording {self.path} was moved away: {where}")
            self._on_moved = None

    def _drain(self) -> None:
        """Write what waits now; what comes meanwhile is the next round's, lest the file wait for ever."""
        for _ in range(len(self._queue)):
            self._writer.write(self._queue.popleft())
        self._writer.flush()
        self._room.set()

    def _stop(self, why: str) -> None:
        self._stopped = True
        self._queue.clear()
        self._room.set()
        self._abandon()
        self.error = why
        if self._on_error is not None:
            self._on_error(self.error)

    def _abandon(self) -> None:
        with suppress(OSError):
            self._stream.close()


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)

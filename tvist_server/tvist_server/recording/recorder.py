"""Takes messages from the tick thread without blocking it, and writes them in its own thread."""

import logging
import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Event as Flag
from threading import Thread, current_thread
from typing import Any, Self

import msgspec

from tvist_controller.instruments.report import Report, Sink
from tvist_protocol.errors import TvistError
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.recorded import topics
from tvist_protocol.stream import Event, State, Truth
from tvist_server.recording import Kept, RecorderError
from tvist_server.recording.segments import DeletedError, Segments
from tvist_server.recording.writer import heading

log = logging.getLogger(__name__)

QUEUE_SIZE = 8192
"""Number of messages that may wait: 30 MB or 5 s, for which a file system's commit may block writing."""
PAUSE = 0.02
"""Time between queue checks [s]; waking the writer would cost a system call and the interpreter's lock."""
CHECK_EVERY = 1.0  # time between two checks whether the file was moved or deleted [s]


class Recorder(Sink):
    """Records one robot until it is closed; RecorderError if the recording cannot start.

    Messages come from one thread; they are not copied and must not change afterwards. Without `wait`, taking
    a message never blocks, and it never raises: if the queue is full or the recording has stopped, messages
    are dropped and counted.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],  # with `keep`, segments are named after it
        info: Info,
        start: Mapping[str, Any],  # what a replay needs besides the journal, as types of JSON
        *,
        keep: int | None = None,  # least number of ticks kept, in segments; None: all
        wait: bool = False,  # whether to wait when the queue is full (lockstep and free)
        on_error: Callable[[str], None] | None = None,  # called once in the writer's thread if that stops
        on_moved: Callable[[str], None] | None = None,  # called once when the file was moved
    ) -> None:
        self.path = Path(path)
        self.error: str | None = None  # why the recording stopped by itself
        self._dropped: dict[type[msgspec.Struct], int] = dict.fromkeys((State, Event, Truth, Io, Entry), 0)
        self._queue: deque[Kept | State] = deque()
        self._wait = wait
        self._on_error = on_error
        self._on_moved = on_moved
        self._stopped = False
        self._closing = False
        self._wake = Flag()
        self._room = Flag()
        self._begin(info, start, keep)
        self.place: Path | None = self._file.whole
        """Where readers find the recording: the last known path of the file, or a pattern for all segments."""
        # A daemon thread does not keep a program alive that ends without `close`; the file stays readable.
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def take(self, message: Kept | State) -> None:
        """Take a message of any kind."""
        if self._wait and len(self._queue) >= QUEUE_SIZE:
            self._wait_for_room()
        if self._stopped or len(self._queue) >= QUEUE_SIZE:
            self._dropped[State if isinstance(message, Report) else type(message)] += 1
        else:
            self._queue.append(message)

    report = state = event = truth = io = journal = take

    @property
    def dropped(self) -> int:
        """Number of messages dropped because the queue was full or the recording had stopped."""
        return sum(self._dropped.values())

    def close(self) -> None:
        """Write the waiting messages and the index, and end the thread. A second call does nothing."""
        self._stopped = True
        self._closing = True
        self._wake.set()
        if current_thread() is not self._thread:
            self._thread.join()

    def discard(self) -> None:
        """Remove a recording that never started, because its file would block the next start."""
        self.close()
        self._file.path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wait_for_room(self) -> None:
        self._room.clear()
        self._wake.set()
        while len(self._queue) >= QUEUE_SIZE and not self._stopped:
            self._room.wait(PAUSE)

    def _begin(self, info: Info, start: Mapping[str, Any], keep: int | None) -> None:
        try:
            topic_of, first = topics(info.name), heading(info, start)
        except (TypeError, ValueError, TvistError) as error:
            raise RecorderError(f"{self.path} cannot be started: {error}") from error
        try:
            self._file = Segments(self.path, topic_of, first, self._dropped, keep)
        except FileExistsError as error:
            raise RecorderError(
                f"{error.filename} exists already and is not overwritten: choose another file, or record with --keep "
                "10min, which numbers its files"
            ) from None
        except OSError as error:
            raise RecorderError(f"{self.path} cannot be written: {_reason(error)}") from error
        if keep is not None and self.path.exists():
            log.warning("%s is an earlier recording and stays: this one is %s", self.path, self._file.whole)

    def _run(self) -> None:
        try:
            checked = time.monotonic()
            while not self._closing:
                self._wake.wait(PAUSE)
                self._wake.clear()
                self._drain()
                if time.monotonic() - checked >= CHECK_EVERY:
                    self._check_file()
                    checked = time.monotonic()
            self._drain()
            self._file.finish()
            self._check_file()
            self._file.close()
        except DeletedError:
            self._stop(
                f"the recording {self._file.path} was deleted, or moved to another file system, where it ends: "
                "no more is recorded"
            )
        except Exception as error:  # noqa: BLE001  nothing above this thread would report it
            self._stop(f"the recording {self.path} has stopped and is incomplete: {_reason(error)}")

    def _check_file(self) -> None:
        """If the file was moved, report that once; if deleted, raise DeletedError, as its data is lost."""
        there, expected = self._file.where(), self._file.path
        self.place = self._file.whole if there == expected else there
        if there != expected and self._on_moved is not None:
            where = "it continues in that file" if there is None else f"it continues in {there}"
            self._on_moved(f"the recording {expected} was moved away: {where}")
            self._on_moved = None

    def _drain(self) -> None:
        """Write the messages that wait now; later ones must wait, so that the file is checked regularly."""
        for _ in range(len(self._queue)):
            message = self._queue.popleft()
            self._file.write(message.state if isinstance(message, Report) else message)
        self._file.flush()
        self._room.set()

    def _stop(self, why: str) -> None:
        self._stopped = True
        self._queue.clear()
        self._room.set()
        with suppress(OSError):
            self._file.close()
        self.error = why
        if self._on_error is not None:
            self._on_error(self.error)


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)

"""Files of a recording: one growing file, or segments of which the oldest are deleted.

The segments of `run.mcap` are `run-1-part0001.mcap` and so on, those of the next run `run-2-part0001.mcap` and so on,
so that a service can restart with the same options. Each is a complete file; only the last one can lose data.
"""

import os
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from typing import IO

import msgspec
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from tvist_protocol.io import Io
from tvist_protocol.recorded import FROM_TICK, Recorded, segment_name, segment_of
from tvist_protocol.stream import State
from tvist_server.recording.writer import RecordingWriter

PARTS = 4  # number of segments for the ticks that must be kept
KEPT_RUNS = 5  # number of earlier runs whose recordings are kept


class DeletedError(Exception):
    """The file has been deleted; its data will be lost when it is closed."""


class Segments:
    """Writes a recording; FileExistsError or OSError if it cannot."""

    def __init__(
        self,
        path: Path,  # segments are named after it
        topic_of: Mapping[type[msgspec.Struct], str],
        heading: dict[str, str],  # metadata at the beginning of each file
        dropped: Mapping[type[msgspec.Struct], int],  # messages dropped by kind; the recorder updates it
        keep: int | None,  # least number of ticks in all segments; None: one file
    ) -> None:
        self.path = self.whole = path
        """The growing file, and the path of the recording for readers, a pattern if there are segments."""
        self._name, self._topic_of, self._heading, self._keep = path, topic_of, heading, keep
        self._dropped, self._counted = dropped, dict(dropped)
        self._held: deque[tuple[int, Path]] = deque()  # first tick of each segment
        self._first: int | None = None
        self._last = 0
        self._io: Io | None = None
        if keep is None:
            self._begin({})
            return
        self._run, self._number = _new_run(path), 1
        self.path = path.with_name(segment_name(path.name, self._run, 1))
        self.whole = path.with_name(segment_name(path.name, self._run, None))
        self._begin({})

    def write(self, message: Recorded) -> None:
        """Add a message; start a new segment before a tick if the present one is full. May raise OSError."""
        if self._first is None:
            self._first = message.tick
            self._held.append((message.tick, self.path))
        elif self._keep is not None and message.tick > self._last >= self._first + self._keep // PARTS - 1:
            self._turn(message.tick, self._keep)
        if isinstance(message, State):
            self._last = message.tick
        elif isinstance(message, Io):
            self._io = message
        self._writer.write(message)

    def flush(self) -> None:
        """Pass complete chunks to the operating system, so that they survive the end of this process."""
        self._stream.flush()

    def finish(self) -> None:
        """Write the last chunk, the numbers of dropped messages, and the index."""
        now = dict(self._dropped)
        self._writer.finish({kind: count - self._counted[kind] for kind, count in now.items()})
        self._counted = now

    def where(self) -> Path | None:
        """Return the growing file's present path; None: unknown after a move. DeletedError if deleted."""
        here = os.fstat(self._stream.fileno())
        if here.st_nlink == 0:
            raise DeletedError
        try:
            if os.path.samestat(self.path.stat(), here):
                return self.path
        except (FileNotFoundError, NotADirectoryError):
            pass
        except OSError:  # the folder cannot be read now, so the file may still be there
            return self.path
        try:
            there = Path(f"/proc/self/fd/{self._stream.fileno()}").readlink()
            return there if os.path.samestat(there.stat(), here) else None
        except OSError:  # the system may report a deleted name of a file with several names
            return None

    def close(self) -> None:
        """Close the file; without `finish` before, it has no index."""
        self._stream.close()

    def _begin(self, more: dict[str, str]) -> None:
        self._stream = self.path.open("xb")
        try:
            _claim(self._stream)
            self._writer = RecordingWriter(self._stream, self._topic_of, self._heading | more)
        except OSError:
            self.path.unlink()  # an incomplete heading would block the next start
            with suppress(OSError):
                self._stream.close()
            raise

    def _turn(self, tick: int, keep: int) -> None:
        """Complete the segment, start the next one with this tick, and delete segments no longer needed."""
        self.finish()
        self._stream.close()
        self._number += 1
        self.path = self._name.with_name(segment_name(self._name.name, self._run, self._number))
        self._begin({FROM_TICK: str(tick)})
        if self._io is not None:
            self._writer.write(self._io)
        self._first = tick
        self._held.append((tick, self.path))
        while self._held[1][0] <= tick - keep:
            self._held.popleft()[1].unlink(missing_ok=True)


def _new_run(path: Path) -> int:
    """Return a new run's number; delete the oldest and empty runs, unless in use. Empty runs do not count."""
    runs: dict[int, list[Path]] = {}
    for place in path.parent.iterdir():
        found = segment_of(place.name)
        if found is not None and found[0] == path.name and place.is_file():
            runs.setdefault(found[1], []).append(place)
    kept = [run for run in sorted(runs) if not all(map(_is_empty, runs[run]))]
    for run in runs.keys() - kept[-KEPT_RUNS:]:
        if not any(map(_is_claimed, runs[run])):
            for place in runs[run]:
                place.unlink(missing_ok=True)
        else:
            kept.append(run)
    return max(kept, default=0) + 1


def _claim(stream: IO[bytes]) -> None:
    """Lock an open file until it is closed; raise BlockingIOError if another process has locked it."""
    try:
        flock(stream, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # not a file, or a file system without locks
        return


def _is_claimed(place: Path) -> bool:
    with place.open("rb") as stream:
        try:
            _claim(stream)
        except BlockingIOError:
            return True
    return False


def _is_empty(place: Path) -> bool:
    """Return whether a recording ends before its first message; False for other files."""
    with place.open("rb") as stream:
        try:
            return not any(
                isinstance(record, Chunk) for record in StreamReader(stream, emit_chunks=True).records
            )
        except EndOfFile:
            return True
        except McapError:
            return False

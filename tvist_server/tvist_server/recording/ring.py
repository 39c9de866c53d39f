"""Recording of the last minutes: two files, of which the older one is replaced when the newer one is long enough.

`run.mcap` grows until it holds as many ticks as have to be kept. Then it replaces `run.earlier.mcap`, and a new
`run.mcap` begins. Together they hold that many ticks at least, and twice as many at most. Neither needs to be closed to
be read, so nothing is lost with the process but the last chunk. At the end both become one file with an index.
"""

import errno
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from tvist_protocol.io import Io
from tvist_protocol.recorded import FROM_TICK, RING, Recorded, earlier_name
from tvist_protocol.stream import State
from tvist_server.recording.joined import complete
from tvist_server.recording.writer import RecordingWriter


class Ring:
    """Writes a recording that forgets its beginning.

    Args:
        path: Path of the newer file, and of the whole recording at the end.
        topic_of: Topic of each kind of message.
        heading: Metadata at the beginning of each file.
        overwrite: Whether to replace existing files.
        keep: Number of ticks to keep at least.

    Raises:
        FileExistsError: One of the files exists.
        OSError: The file cannot be written.
    """

    def __init__(
        self,
        path: Path,
        topic_of: Mapping[type[msgspec.Struct], str],
        heading: dict[str, str],
        *,
        overwrite: bool,
        keep: int,
    ) -> None:
        self._path, self._earlier = path, path.with_name(earlier_name(path.name))
        self._topic_of, self._heading, self._keep = topic_of, heading | {RING: str(keep)}, keep
        if overwrite:
            self._earlier.unlink(missing_ok=True)
        elif self._earlier.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(self._earlier))
        self._first: int | None = None
        self._last = 0
        self._io: Io | None = None
        self._turned = False
        self._begin(path, "wb" if overwrite else "xb", {})

    def write(self, message: Recorded) -> None:
        """Add a message; between two ticks, begin a new file if this one holds enough.

        Raises:
            OSError: A file cannot be written or renamed.
        """
        if self._first is None:
            self._first = message.tick
        elif message.tick > self._last >= self._first + self._keep - 1:
            self._turn(message.tick)
        if isinstance(message, State):
            self._last = message.tick
        elif isinstance(message, Io):
            self._io = message
        self._writer.write(message)

    def flush(self) -> None:
        """Pass complete chunks to the operating system."""
        self._writer.flush()

    def finish(self, dropped: Mapping[type[msgspec.Struct], int]) -> None:
        """Join the files to one with an index, under the path of the recording."""
        self._writer.end_part()
        if not self._turned:
            complete(self._path, None, dropped)
        else:
            complete(self._earlier, self._path, dropped)
            self._earlier.replace(self._path)

    def fileno(self) -> int:
        """Return the descriptor of the newer file."""
        return self._stream.fileno()

    def close(self) -> None:
        """Close the newer file."""
        self._stream.close()

    def _begin(self, path: Path, mode: str, more: dict[str, str]) -> None:
        self._stream = path.open(mode)
        try:
            self._writer = RecordingWriter(self._stream, self._topic_of, self._heading | more, part=True)
        except OSError:
            if mode == "xb":
                path.unlink()  # what the disk had no room for would count as the recording of a run
            with suppress(OSError):
                self._stream.close()
            raise

    def _turn(self, tick: int) -> None:
        """Let the newer file replace the older one, and begin a new one; a file is at `path` at any time."""
        self._writer.end_part()
        self._stream.close()
        following = self._path.with_name(f".{self._path.name}.next")
        self._begin(following, "wb", {FROM_TICK: str(tick)})
        if self._io is not None:
            self._writer.write(self._io)
        link = self._path.with_name(f".{self._path.name}.link")
        try:
            link.unlink(missing_ok=True)
            os.link(self._path, link)
        except OSError:  # this file system has no links: for a moment there is no file at `path`
            self._path.replace(self._earlier)
        else:
            link.replace(self._earlier)
        try:
            following.replace(self._path)
        except OSError:
            with suppress(OSError):
                following.unlink()
            raise
        self._first, self._turned = tick, True

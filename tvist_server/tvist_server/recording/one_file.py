"""File of a recording that grows from the first message to the last."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from tvist_protocol.recorded import Recorded
from tvist_server.recording.writer import RecordingWriter


class OneFile:
    """Writes a recording to one file.

    Args:
        path: Path of the file.
        topic_of: Topic of each kind of message.
        heading: Metadata at its beginning.
        overwrite: Whether to replace an existing file.

    Raises:
        FileExistsError: The file exists.
        OSError: It cannot be written.
    """

    def __init__(
        self,
        path: Path,
        topic_of: Mapping[type[msgspec.Struct], str],
        heading: dict[str, str],
        *,
        overwrite: bool,
    ) -> None:
        self._stream = path.open("wb" if overwrite else "xb")
        try:
            self._writer = RecordingWriter(self._stream, topic_of, heading)
        except OSError:
            if not overwrite:
                path.unlink()  # what the disk had no room for would only stand in the way of the next start
            with suppress(OSError):
                self._stream.close()
            raise

    def write(self, message: Recorded) -> None:
        """Write a message into the present chunk."""
        self._writer.write(message)

    def flush(self) -> None:
        """Pass complete chunks to the operating system."""
        self._writer.flush()

    def finish(self, dropped: Mapping[type[msgspec.Struct], int]) -> None:
        """Write the last chunk, the numbers of dropped messages and the index."""
        self._writer.finish(dropped)

    def fileno(self) -> int:
        """Return the descriptor of the open file."""
        return self._stream.fileno()

    def close(self) -> None:
        """Close the file; without `finish` before, it has no index."""
        self._stream.close()

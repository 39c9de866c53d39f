"""Recordings of earlier runs: what is at a path when a recording begins gets a number, and the newest ones are kept.

So a service that starts again and again with the same options needs nobody to clear the way. A start that fails leaves
no recording, and what a run leaves that has recorded nothing gets no number. So neither costs an earlier recording its
place.
"""

import os
import re
import struct
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode

from tvist_protocol.recorded import earlier_name

MOST = 5
"""Number of earlier runs of which recordings are kept."""
MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a recording."""
RECORD = struct.Struct("<BQ")
"""Beginning of a record of a recording: its kind, and its length."""


class OccupiedError(Exception):
    """A file at the place of a recording must stay there; the message says why."""


def claim(stream: IO[bytes]) -> None:
    """Mark an open file as one that is being written, until it is closed or the process is gone.

    Raises:
        BlockingIOError: Another process writes it.
    """
    try:
        flock(stream, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # it is no file, or on a file system without locks
        return


def set_aside(path: Path) -> Path | None:
    """Give the recording at a path the next number, and remove those of the oldest runs.

    Returns:
        Where it is now; None if there was none, or it held no message and was removed.

    Raises:
        OccupiedError: There is another kind of file, or the recording is still being written.
        OSError: A file cannot be read or renamed.
    """
    there = [place for place in (path, _earlier(path)) if place.exists()]
    if not there:
        return None
    for place in there:
        _check(place)
    if all(map(_is_empty, there)):
        for place in there:
            place.unlink()
        return None
    numbers = sorted(
        int(number)
        for place in path.parent.iterdir()
        for number in re.findall(r"\.earlier-(\d+)", place.name)
        if place.name == earlier_name(path.name, int(number))
    )
    number = numbers[-1] + 1 if numbers else 1
    kept = path.with_name(earlier_name(path.name, number))
    # The newer part last, and only it takes the number: after a kill in between, the next start completes the pair.
    for place in reversed(there):
        place.replace(kept if place == there[0] else _earlier(kept))
    for old in numbers[: -(MOST - 1)]:
        oldest = path.with_name(earlier_name(path.name, old))
        for place in (_earlier(oldest), oldest):
            place.unlink(missing_ok=True)
    return kept


def _earlier(path: Path) -> Path:
    return path.with_name(earlier_name(path.name))


def _is_empty(place: Path) -> bool:
    """Return whether a recording ends before its first message."""
    with place.open("rb") as stream:
        if (begun := stream.read(len(MAGIC))) != MAGIC:
            return not begun
        while len(record := stream.read(RECORD.size)) == RECORD.size:
            kind, length = RECORD.unpack(record)
            if kind == Opcode.CHUNK:
                return False
            stream.seek(length, os.SEEK_CUR)
    return True


def _check(place: Path) -> None:
    with place.open("rb") as stream:
        try:
            claim(stream)
        except BlockingIOError:
            raise OccupiedError(f"{place} is being written by another process") from None
        # A power failure may leave a file that is empty or full of zeros.
        if not MAGIC.startswith(stream.read(len(MAGIC)).rstrip(b"\0")):
            raise OccupiedError(f"{place} is no recording, and is not replaced")

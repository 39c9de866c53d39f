"""Write files that appear under their name only when they are complete."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

IN_PLACE = {errno.EBUSY, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENAMETOOLONG}
"""Errors after which a file that cannot be replaced may still be writable in place."""
UNFINISHED = ".tmp"  # suffix of an incomplete file, which remains if the program is killed


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """Yield a stream whose content replaces `path` when the block ends; after an error, `path` is unchanged.

    Raises OSError if the file cannot be written, for example because the disk is full.
    """
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=UNFINISHED, dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            os.fchmod(stream.fileno(), 0o666 & ~_umask())
        Path(name).replace(path)
    except BaseException:
        with suppress(OSError):
            Path(name).unlink()
        raise


def write_whole(path: Path, content: bytes) -> None:
    """Write a file completely, or leave it unchanged.

    A link, a device such as /dev/stdout, and a file that cannot be replaced, such as a mount point, are
    written in place.
    """
    if path.is_symlink() or (path.exists() and (not path.is_file() or path.stat().st_nlink > 1)):
        path.write_bytes(content)
        return
    try:
        with whole_file(path) as stream:
            stream.write(content)
    except OSError as error:
        if error.errno not in IN_PLACE:
            raise
        path.write_bytes(content)


def _umask() -> int:
    """Return the mask for new files, which temporary files ignore."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask

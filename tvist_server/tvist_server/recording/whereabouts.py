"""Current path of an open file, which may be moved or deleted without an error."""

import os
from pathlib import Path


class DeletedError(Exception):
    """The file has been deleted: its data disappears when it is closed."""


def whereabouts(path: Path, descriptor: int) -> Path | None:
    """Return the current path of an open file.

    Args:
        path: Path at which the file was opened.
        descriptor: Descriptor of the open file.

    Returns:
        `path` while it is still this file, else the file's new path; None if the system does not report it.

    Raises:
        DeletedError: The file no longer has a name.
    """
    here = os.fstat(descriptor)
    if here.st_nlink == 0:
        raise DeletedError
    try:
        if os.path.samestat(path.stat(), here):
            return path
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError:  # the folder cannot be read now, which says nothing about the file
        return path
    try:
        there = Path(f"/proc/self/fd/{descriptor}").readlink()
        return there if os.path.samestat(there.stat(), here) else None
    except OSError:  # of several names, the system may report a deleted one
        return None

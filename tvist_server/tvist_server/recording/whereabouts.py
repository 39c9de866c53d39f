"""Current place of a file that is being written: it may be moved or deleted meanwhile without an error."""

import os
from pathlib import Path


class DeletedError(Exception):
    """The file has no name any more: when it is closed, it is gone."""


def whereabouts(path: Path, descriptor: int) -> Path | None:
    """Return the current path of an open file.

    Args:
        path: Path at which the file was opened.
        descriptor: It.

    Returns:
        `path` while that is this file, else the file's new name; None where the system does not tell it.

    Raises:
        DeletedError: It has none.
    """
    here = os.fstat(descriptor)
    if here.st_nlink == 0:
        raise DeletedError
    try:
        if os.path.samestat(path.stat(), here):
            return path
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError:  # the folder cannot be looked into now: that says nothing about the file
        return path
    try:
        there = Path(f"/proc/self/fd/{descriptor}").readlink()
        return there if os.path.samestat(there.stat(), here) else None
    except OSError:  # of several names the system may tell one that is gone
        return None

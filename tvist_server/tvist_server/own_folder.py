"""A temporary folder. If its process is killed, the next process that makes such a folder removes it."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path

_PREFIX = "tvist-own-"


class OwnFolder:
    """A folder that only this user can enter, until `close`; locked while this process or a fork of it lives.

    Unlocked folders of this user are left over from killed processes and are removed first. May raise OSError.
    """

    def __init__(self) -> None:
        import fcntl  # Windows does not have it

        temporary = Path(tempfile.gettempdir())
        for left in temporary.glob(f"{_PREFIX}*"):
            _remove_unless_held(left)
        made = Path(tempfile.mkdtemp(prefix=".tvist-"))
        self._lock = os.open(made, os.O_RDONLY)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        self.path = made.rename(temporary / f"{_PREFIX}{made.name.removeprefix('.tvist-')}")

    def remove(self) -> None:
        """Remove the folder, even if it is in use."""
        shutil.rmtree(self.path, ignore_errors=True)

    def close(self) -> None:
        """Remove the folder and its lock; a second call does nothing."""
        self.remove()
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


def _remove_unless_held(folder: Path) -> None:
    import fcntl

    with contextlib.suppress(OSError):  # another user's, or locked
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            if os.fstat(lock).st_uid == os.geteuid():
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(lock)

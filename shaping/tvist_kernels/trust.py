"""Whether what lies in a folder can be run: nobody but this user and root can have put it there."""

import errno
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path


class DistrustError(OSError):
    """Someone else can write a file, or into its folder; the message names the place, its owner or mode, the remedy."""


def real_folder(folder: Path) -> Path:
    """Return where a folder into which nobody else can put a file, now or later, really is; it need not exist yet.

    Each folder on the way, looked at from the root down, keeps what is below it in its place: nobody else can exchange
    it between this look and what follows, as somebody could exchange a link to it. A folder that everybody can write
    in, such as /tmp, does so if it is sticky.

    Raises:
        DistrustError: It is not this user's or root's alone.
        OSError: It cannot be looked at.
    """
    real = Path(os.path.realpath(folder))
    if sys.platform == "win32":  # where folders have no such owners and modes
        return real
    # In a container without root, the root of all folders may belong to somebody else.
    holders = {0, os.geteuid(), Path("/").stat().st_uid}
    with suppress(FileNotFoundError):
        for place in (*reversed(real.parents), real):
            _check(
                place, place.lstat(), {0, os.geteuid()} if place == real else holders, sticky=place != real
            )
    return real


def read_file(file: Path) -> bytes:
    """Read a file that nobody but this user and root can have written; its folder is a `real_folder`.

    Raises:
        DistrustError: Somebody else owns it or can write it.
        OSError: It cannot be read, or is a link.
    """
    # What has been opened is looked at, not what has this name a moment before. No pipe can hold this process up.
    flags = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    with open(os.open(file, os.O_RDONLY | flags), "rb") as stream:  # noqa: PTH123  a descriptor
        if sys.platform != "win32":
            _check(file, os.fstat(stream.fileno()), {0, os.geteuid()}, sticky=False)
        return stream.read()


def check_file(file: Path) -> None:
    """Check, as a look that `read_file` repeats, that nobody but this user and root can have written a file.

    Raises:
        DistrustError: Somebody else owns it or can write it.
        OSError: It is not there, or is a link.
    """
    if sys.platform != "win32":
        found = file.lstat()
        if stat.S_ISLNK(found.st_mode):  # whose mode says nothing
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(file))
        _check(file, found, {0, os.geteuid()}, sticky=False)


def make_folder(folder: Path) -> Path:
    """Make a folder, and those above it, in which this user alone can write, and return where it really is.

    Raises:
        DistrustError: It is there already, or is to be made where somebody else can write.
        OSError: It cannot be made.
    """
    real = real_folder(folder)
    for missing in reversed([one for one in (real, *real.parents) if not one.exists()]):
        missing.mkdir(mode=0o755, exist_ok=True)
    return real_folder(real)  # somebody may have been quicker


def _check(place: Path, found: os.stat_result, owners: set[int], *, sticky: bool) -> None:
    mode = stat.S_IMODE(found.st_mode)
    who, remedy = "", f"chmod go-w {place}"
    if found.st_uid not in owners:
        who, remedy = "who is neither you nor root", "let a folder of yours take its place"
    elif mode & (stat.S_IWGRP | stat.S_IWOTH) and not (sticky and mode & stat.S_ISVTX):
        who = "and everybody can write there" if mode & stat.S_IWOTH else "and its group can write there"
    if who:
        raise DistrustError(f"{place} (mode {mode:o}) belongs to {_name(found.st_uid)}, {who}: {remedy}")


def _name(user: int) -> str:
    if sys.platform == "win32":
        return str(user)
    import pwd

    try:
        return f"{pwd.getpwuid(user).pw_name} (user {user})"
    except KeyError:
        return f"user {user}"

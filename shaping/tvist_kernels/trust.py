"""Check that only this user and root can have written a file, before its code is run."""

import errno
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path


class DistrustError(OSError):
    """Someone else can write a file or its folder; the message has the place, owner, mode and remedy."""


def real_folder(folder: Path) -> Path:
    """Resolve a folder, which need not exist yet; check that other users can never put files in it.

    Folders are checked from the root down. If nobody else can write in a folder, nobody else can replace the
    folders below it after the check. In a sticky folder, such as /tmp, everybody can write, but nobody can
    replace folders of others. Raise DistrustError if others can write in a folder, and OSError if a folder
    cannot be inspected.
    """
    real = Path(os.path.realpath(folder))
    if sys.platform == "win32":  # folders have no such owners and modes there
        return real
    # In a rootless container, / may belong to somebody else.
    holders = {0, os.geteuid(), Path("/").stat().st_uid}
    with suppress(FileNotFoundError):
        for place in (*reversed(real.parents), real):
            _check(
                place, place.lstat(), {0, os.geteuid()} if place == real else holders, sticky=place != real
            )
    return real


def read_file(file: Path) -> bytes:
    """Read a file in a `real_folder`; raise DistrustError if somebody else owns it or can write it.

    Raise OSError if it cannot be read or is a link.
    """
    # Check the opened file, not the name, which may change in between. O_NONBLOCK: a pipe must not block this process.
    flags = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
    with open(os.open(file, os.O_RDONLY | flags), "rb") as stream:  # noqa: PTH123  a descriptor
        if sys.platform != "win32":
            _check(file, os.fstat(stream.fileno()), {0, os.geteuid()}, sticky=False)
        return stream.read()


def check_file(file: Path) -> None:
    """Check a file without reading it; `read_file`, which raises the same errors, checks it again."""
    if sys.platform != "win32":
        found = file.lstat()
        if stat.S_ISLNK(found.st_mode):  # the mode of a link says nothing about its target
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(file))
        _check(file, found, {0, os.geteuid()}, sticky=False)


def make_folder(folder: Path) -> Path:
    """Make a folder and its parents so that only this user can write there; return its resolved path.

    Raise DistrustError if somebody else can write in the folder or in the place where it would be made, and
    OSError if it cannot be made.
    """
    real = real_folder(folder)
    for missing in reversed([one for one in (real, *real.parents) if not one.exists()]):
        missing.mkdir(mode=0o755, exist_ok=True)
    return real_folder(real)  # another process may have made it first


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

"""Python files of the user's own, named as FILE.py:NAME, with a shaper or a plant in them.

Only the command line, a configuration and a state file can name files. A client on the network cannot, and a recording
never causes a file to be run.
"""

import hashlib
import re
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Protocol

from tvist_plant.user_file import named, read_bytes

_FILE = re.compile(r"(?P<file>.*\.py)(?::(?P<attribute>.*))?", re.DOTALL)


class OwnFileError(ValueError):
    """A file does not contain what its user says; the message gives the file, the name and the reason."""


class MayBeOne(Protocol):
    """Tells whether a value of a file is of the kind that is looked for, to name those that are."""

    def __call__(self, value: object, *, own: bool) -> bool:
        """Take a value, and whether it was defined in the file rather than imported."""


@dataclass(frozen=True)
class OwnFile:
    """What a file contains under a name."""

    file: str
    """Path of the file, as it was given."""
    attribute: str
    """Name in the file."""
    sha256: str
    """SHA-256 of the bytes that were run, in hexadecimal; it does not cover what the file imports."""
    found: object
    """The value of that name."""


def is_file(place: str) -> bool:
    """Whether something is given as FILE.py:NAME rather than by its name."""
    return _FILE.fullmatch(place) is not None


def ends(failure: BaseException) -> bool:
    """Whether a signal ends the process while a file's code runs, by an exit of a kind of its own."""
    return isinstance(failure, SystemExit) and type(failure) is not SystemExit


def run_file(place: str, kind: str, error: type[OwnFileError], may_be_one: MayBeOne) -> OwnFile:
    """Run FILE.py of FILE.py:NAME, and return what it contains under the name, if it may be one of the kind.

    Raises:
        OwnFileError: The file or the name does not exist, or running the file raises an exception.
        UserFileError: The file is not text, or is larger than 4 MiB.
    """
    named = _FILE.fullmatch(place)
    if named is None:
        raise error(
            f"{kind} is {place!r}: must be FILE.py:NAME, a Python file and the name of a {kind} in that file"
        )
    file, attribute = named["file"], named["attribute"]
    if not attribute:
        raise error(f"{kind} {place}: the name of the {kind} is missing: give {file}:NAME")
    try:
        content = read_bytes(file, kind)
    except OSError as failure:
        raise error(f"{kind} {place}: {file} cannot be read: {failure.strerror}") from failure
    sha256 = hashlib.sha256(content).hexdigest()
    module = _run(content, place, kind, error, sha256)
    if attribute not in vars(module):
        there = ", ".join(
            name
            for name, value in vars(module).items()
            if may_be_one(value, own=getattr(value, "__module__", None) == module.__name__)
        )
        known = f"it contains {there}" if there else f"it contains no {kind}"
        raise error(f"{kind} {place}: {file} does not contain {attribute}; {known}")
    return OwnFile(file, attribute, sha256, vars(module)[attribute])


def _run(content: bytes, place: str, kind: str, error: type[OwnFileError], sha256: str) -> ModuleType:
    file = place.rpartition(":")[0]
    module = ModuleType(f"tvist_own_{kind}_{sha256[:16]}")
    module.__file__ = str(Path(file).resolve())
    sys.modules[module.__name__] = module  # dataclasses and others look their own module up there
    try:
        exec(compile(content, module.__file__, "exec"), module.__dict__)  # noqa: S102  it is what the user asked for
    except (Exception, SystemExit) as failure:
        if ends(failure):
            raise
        frames = [
            frame
            for frame in traceback.extract_tb(failure.__traceback__)
            if frame.filename == module.__file__
        ]
        line = failure.lineno if isinstance(failure, SyntaxError) else frames[-1].lineno if frames else None
        where = "" if line is None else f" in line {line}"
        words = named(failure, failure.msg if isinstance(failure, SyntaxError) else None)
        raise error(f"{kind} {place}: running {file} raises {words}{where}") from failure
    return module

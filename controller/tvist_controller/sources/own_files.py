"""Users' Python files with a shaper or plant (FILE.py:NAME); network clients and recordings cannot name one."""

import hashlib
import re
import sys
import traceback
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from tvist_plant.user_file import named, read_bytes

_FILE = re.compile(r"(?P<file>.*\.py)(?::(?P<attribute>.*))?", re.DOTALL)


class OwnFileError(ValueError):
    """A shaper or plant does not exist or cannot be made; the message states FILE.py:NAME and the reason."""


class OwnFile(NamedTuple):
    """What a file defines under a name."""

    file: str
    attribute: str
    sha256: str  # SHA-256 of the bytes that were run, in hexadecimal, without imported files
    found: object


def is_file(place: str) -> bool:
    """Return whether a place has the form FILE.py:NAME."""
    return _FILE.fullmatch(place) is not None


def ends(failure: BaseException) -> bool:
    """Return whether an exception is raised by a signal (subclass of SystemExit) and must end the process."""
    return isinstance(failure, SystemExit) and type(failure) is not SystemExit


def run_file(place: str, kind: str, may_be_one: Callable[[object], bool]) -> OwnFile:
    """Run the file of FILE.py:NAME and return what it defines under the name; raise OwnFileError.

    If the name is missing, the message lists those that may be meant.
    """
    if (named := _FILE.fullmatch(place)) is None:
        raise OwnFileError(
            f"{kind} is {place!r}: must be FILE.py:NAME, a Python file and the name of a {kind} in that file"
        )
    file, attribute = named["file"], named["attribute"]
    if not attribute:
        raise OwnFileError(f"{kind} {place}: the name of the {kind} is missing: give {file}:NAME")
    try:
        content = read_bytes(file, kind)
    except OSError as failure:
        raise OwnFileError(f"{kind} {place}: {file} cannot be read: {failure.strerror}") from failure
    sha256 = hashlib.sha256(content).hexdigest()
    module = _run(content, place, kind, sha256)
    if attribute not in vars(module):
        there = ", ".join(name for name, value in vars(module).items() if may_be_one(value))
        known = f"it contains {there}" if there else f"it contains no {kind}"
        raise OwnFileError(f"{kind} {place}: {file} does not contain {attribute}; {known}")
    return OwnFile(file, attribute, sha256, vars(module)[attribute])


def is_of_file(value: object) -> bool:
    """Return whether a value is callable and was defined in the file itself, not imported."""
    return callable(value) and str(getattr(value, "__module__", None)).startswith("tvist_own_")


@lru_cache(maxsize=8)
def load_again(load: Callable[[str], Any], kind: str, place: str, sha256: str) -> Any:
    """Load a shaper or plant again in a worker process; raise OwnFileError if the file has changed."""
    found = load(place)
    if found.sha256 != sha256:
        raise OwnFileError(f"{kind} {place}: the file has changed since it was first loaded")
    return found


def _run(content: bytes, place: str, kind: str, sha256: str) -> ModuleType:
    file = place.rpartition(":")[0]
    module = ModuleType(f"tvist_own_{kind}_{sha256[:16]}")
    module.__file__ = str(Path(file).resolve())
    sys.modules[module.__name__] = module  # dataclasses look up their module there
    try:
        exec(compile(content, module.__file__, "exec"), module.__dict__)  # noqa: S102  it is what the user asked for
    except (Exception, SystemExit) as failure:
        if ends(failure):
            raise
        frames = traceback.extract_tb(failure.__traceback__)
        lines, said = [frame.lineno for frame in frames if frame.filename == module.__file__], None
        if isinstance(failure, SyntaxError):
            lines, said = [failure.lineno], failure.msg
        where = f" in line {lines[-1]}" if lines and lines[-1] is not None else ""
        words = named(failure, said)
        raise OwnFileError(f"{kind} {place}: running {file} raises {words}{where}") from failure
    return module

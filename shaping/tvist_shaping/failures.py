"""Describe failures of a shaper's function."""

from pathlib import Path
from traceback import walk_tb

from tvist_shaping._types import Floats
from tvist_shaping.errors import ShaperFailureError

FAILURES = (Exception, SystemExit)
"""Exceptions that a user's function may raise; KeyboardInterrupt is not among them."""
ROUNDING = 1e-6  # share by which rounding may let a value exceed its shaper's declaration [-]
_HERE = Path(__file__).parent


def failure(error: BaseException, f_d: Floats, zeta: Floats) -> str:
    """Describe an error and its modes, as a phrase to follow a shaper's name."""
    asked = ", ".join(f"f_d = {f:g} Hz and ζ = {z:g}" for f, z in zip(f_d, zeta, strict=True))
    return f"{words(error)} for {asked}"


def words(error: BaseException) -> str:
    """Describe an error as a phrase to follow a shaper's name, e.g. `raises ValueError: …`."""
    if isinstance(error, ShaperFailureError):
        return error.why
    said = " ".join(str(error).split())[:200]
    return f"raises {type(error).__name__}{f': {said}' if said else ''}{_place(error)}"


def _place(error: BaseException) -> str:
    """Return in words where a user's file raised an error: first file outside ours, and last line in it."""
    lines: dict[str, int] = {}
    for frame, line in walk_tb(error.__traceback__):
        file = frame.f_code.co_filename
        if Path(file).parent != _HERE:
            lines[file] = line
    return next((f" in line {line} of {Path(file).name}" for file, line in lines.items()), "")

"""How a shaper's function may fail, and what to say of it."""

from typing import Final

from tvist_shaping._types import Floats
from tvist_shaping.errors import ShaperFailureError

FAILURES: Final = (Exception, SystemExit)
"""What a function that somebody else wrote may raise. Control+C is not its doing."""
ROUNDING: Final = 1e-6
"""Share by which a figure may be beyond what its shaper declares [-]."""


def failure(error: BaseException, f_d: Floats, zeta: Floats) -> str:
    """What went wrong, and for which modes; it goes on after a shaper's name.

    Args:
        error: What the function raised.
        f_d: Damped frequencies it was asked for [Hz], shape (modes,).
        zeta: Damping ratios it was asked for [-], shape (modes,).
    """
    asked = ", ".join(f"f_d = {f:g} Hz and ζ = {z:g}" for f, z in zip(f_d, zeta, strict=True))
    return f"{words(error)} for {asked}"


def words(error: BaseException) -> str:
    """What goes on after a shaper's name: `raises ValueError: …`, or what it gives that is wrong."""
    if isinstance(error, ShaperFailureError):
        return error.why
    said = " ".join(str(error).split())[:200]
    name = type(error).__name__
    return f"raises {name}: {said}" if said else f"raises {name}"

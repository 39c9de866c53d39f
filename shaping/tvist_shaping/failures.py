"""Failures of a shaper's function, and their descriptions."""

from typing import Final

from tvist_shaping._types import Floats
from tvist_shaping.errors import ShaperFailureError

FAILURES: Final = (Exception, SystemExit)
"""Exceptions that a user's function may raise; Control+C is not among them."""
ROUNDING: Final = 1e-6
"""Share by which a value may exceed its shaper's declaration, because of rounding [-]."""


def failure(error: BaseException, f_d: Floats, zeta: Floats) -> str:
    """Describe an error and its modes, as a phrase to follow a shaper's name.

    Args:
        error: Exception that the function raised.
        f_d: Damped frequencies passed to the function [Hz], shape (modes,).
        zeta: Damping ratios passed to the function [-], shape (modes,).
    """
    asked = ", ".join(f"f_d = {f:g} Hz and ζ = {z:g}" for f, z in zip(f_d, zeta, strict=True))
    return f"{words(error)} for {asked}"


def words(error: BaseException) -> str:
    """Return a phrase to follow a shaper's name: `raises ValueError: …`, or what is wrong with its result."""
    if isinstance(error, ShaperFailureError):
        return error.why
    said = " ".join(str(error).split())[:200]
    name = type(error).__name__
    return f"raises {name}: {said}" if said else f"raises {name}"

"""Compile the functions of the controller."""

from collections.abc import Callable
from typing import Any, TypeVar

from tvist_kernels.compiling import compiled as compile_function

F = TypeVar("F", bound=Callable[..., Any])

__all__ = ["compiled", "compiled_for_ticks"]


def compiled(function: F) -> F:
    """Compile a function so that it releases the GIL; see `tvist_kernels.compiling`."""
    return compile_function(function, nogil=True)


def compiled_for_ticks(function: F) -> F:
    """Compile a function of microseconds that keeps the GIL, which another thread might otherwise take."""
    return compile_function(function)

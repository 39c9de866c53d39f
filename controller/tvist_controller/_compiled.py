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
    """Compile a function that takes microseconds and keeps the GIL, so no other thread takes it meanwhile."""
    return compile_function(function)

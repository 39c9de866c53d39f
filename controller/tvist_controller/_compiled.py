"""Compile the functions of the controller."""

from collections.abc import Callable
from typing import Any, TypeVar

from tvist_kernels.compiling import compiled as compile_function

F = TypeVar("F", bound=Callable[..., Any])

__all__ = ["compiled", "compiled_for_ticks"]


def compiled(function: F) -> F:
    """Compile `function`, see `tvist_kernels.compiling`; it does not hold the interpreter's lock while it runs."""
    return compile_function(function, nogil=True)


def compiled_for_ticks(function: F) -> F:
    """Compile a function that takes microseconds; it holds the interpreter's lock, which another thread might keep."""
    return compile_function(function)

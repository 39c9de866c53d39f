"""Compile the functions of the controller, so that other threads can run while they do."""

from collections.abc import Callable
from typing import Any, TypeVar

from tvist_shaping.compiling import compiled as compile_function
from tvist_shaping.compiling import is_cached

F = TypeVar("F", bound=Callable[..., Any])

__all__ = ["compiled", "is_cached"]


def compiled(function: F) -> F:
    """Compile `function`, see `tvist_shaping.compiling`; it does not hold the interpreter's lock while it runs."""
    return compile_function(function, nogil=True)

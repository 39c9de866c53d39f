"""Compile functions with numba, or use them as plain Python if numba is not installed."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile a function; its Python source remains available as `.py_func`. The cache outlives the process.

    numba detects changes of the file that contains a kernel, but not of the files with functions that it calls. A
    kernel and the functions that it calls are therefore in the same file.
    """
    try:
        from numba import njit
    except ImportError:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    return cast("F", njit(cache=True)(function))

"""Compile a function with numba; where numba is missing the plain Python function serves."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compiled `function`; its Python source stays reachable as `.py_func`. The cache survives the process.

    numba notices a change of the file a kernel stands in, not of the files it calls into: a kernel and what
    it calls stand in one file.
    """
    try:
        from numba import njit
    except ImportError:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    return cast("F", njit(cache=True)(function))

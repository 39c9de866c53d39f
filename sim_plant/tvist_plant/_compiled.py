"""Compile a function with numba; where numba is missing the plain Python function serves."""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compiled `function`; its Python source stays reachable as `.py_func`. The cache survives the process."""
    try:
        from numba import njit
    except ImportError:  # pragma: no cover
        function.py_func = function  # type: ignore[attr-defined]
        return function
    return njit(cache=True)(function)  # type: ignore[no-any-return]

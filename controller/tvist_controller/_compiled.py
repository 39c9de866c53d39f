"""Compile functions with numba."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile `function`; its Python source remains available as `.py_func`; the cache outlives the process."""
    return cast("F", njit(cache=True)(function))

"""Compile functions with numba."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile `function`; its Python source remains available as `.py_func`; the cache outlives the process.

    Other threads can run while it does.
    """
    return cast("F", njit(cache=True, nogil=True)(function))


def is_cached(function: Any) -> bool:
    """Return whether a compiled function's machine code is on disk already; otherwise its first call takes seconds."""
    return any(Path(function.stats.cache_path).glob(f"*.{function.__name__}-*.nbi"))

"""Compile functions with numba, or use them as plain Python if numba is not installed."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F, *, nogil: bool = False) -> F:
    """Compile a function at its first call; its Python source remains available as `.py_func`.

    The machine code is kept on disk, see `cache`.

    Args:
        function: The function; what it calls must be compiled, too.
        nogil: Let other threads run while it runs.
    """
    try:
        from numba import njit
    except ImportError:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    from tvist_kernels.cache import KernelCache

    dispatcher: Any = njit(nogil=nogil)(function)
    # As njit(cache=True) does, with a cache of our own.
    dispatcher._cache = KernelCache(dispatcher.py_func, dispatcher)  # noqa: SLF001
    return cast("F", dispatcher)

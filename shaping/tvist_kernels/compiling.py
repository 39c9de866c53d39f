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
        from numba.core.types import unliteral
    except ImportError:
        function.py_func = function  # type: ignore[attr-defined]
        return function
    from tvist_kernels.cache import KernelCache

    dispatcher: Any = njit(nogil=nogil)(function)
    template = dispatcher.get_call_template
    # Each number that a kernel writes into a call is a type of its own to numba, which would compile for each of them.
    dispatcher.get_call_template = lambda args, kws: template(tuple(map(unliteral, args)), kws)
    # As njit(cache=True) does, with a cache of our own.
    dispatcher._cache = KernelCache(dispatcher.py_func, dispatcher)  # noqa: SLF001
    return cast("F", dispatcher)


def inlined(function: F) -> F:
    """Have a function compiled as a part of the one kernel that calls it, which takes less time than two kernels."""
    try:
        from numba import njit
    except ImportError:
        return compiled(function)
    return cast("F", njit(inline="always")(function))

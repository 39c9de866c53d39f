"""Compile functions with numba, or use them as plain Python if numba is not installed."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F, *, nogil: bool = False) -> F:
    """Compile a function at its first call; keep machine code on disk, and the Python function as `.py_func`.

    All functions that it calls must be compiled, too. With `nogil`, other threads run while it runs.
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
    # numba gives each literal in a call its own type, and would compile the called function once for each of them.
    dispatcher.get_call_template = lambda args, kws: template(tuple(map(unliteral, args)), kws)
    # As njit(cache=True) does, with another cache.
    dispatcher._cache = KernelCache(dispatcher.py_func, dispatcher)  # noqa: SLF001
    return cast("F", dispatcher)


def inlined(function: F) -> F:
    """Have a function compiled as part of the only kernel that calls it, which is faster than two kernels."""
    try:
        from numba import njit
    except ImportError:
        return compiled(function)
    return cast("F", njit(inline="always")(function))

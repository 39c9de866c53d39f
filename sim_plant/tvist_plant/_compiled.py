"""Compile the functions of the plant."""

from functools import partial

from tvist_kernels.compiling import compiled

__all__ = ["compiled", "compiled_for_long"]

compiled_for_long = partial(compiled, nogil=True)
"""Compile a function that computes many periods and releases the GIL, so that other threads can tick."""

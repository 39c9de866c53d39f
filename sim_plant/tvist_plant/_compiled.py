"""Compile the functions of the plant."""

from functools import partial

from tvist_kernels.compiling import compiled

__all__ = ["compiled", "compiled_for_long"]

compiled_for_long = partial(compiled, nogil=True)
"""Compiles a function that takes many periods, so that a robot in another thread ticks meanwhile."""

"""Compile the functions of this library."""

from tvist_kernels.compiling import compiled

__all__ = ["compiled"]

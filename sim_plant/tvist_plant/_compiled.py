"""Compile the functions of the plant."""

from tvist_kernels.compiling import compiled

__all__ = ["compiled"]

"""Compile the functions of this library."""

from tvist_shaping.compiling import compiled

__all__ = ["compiled"]

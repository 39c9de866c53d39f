"""Compile the functions of the plant."""

from tvist_shaping.compiling import compiled

__all__ = ["compiled"]

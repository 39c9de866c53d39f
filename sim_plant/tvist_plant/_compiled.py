"""Compile the functions of the plant."""

from tvist_shaping.compiling import compiled, is_cached

__all__ = ["compiled", "is_cached"]

"""Compile functions and keep their machine code; every other package may import this one."""

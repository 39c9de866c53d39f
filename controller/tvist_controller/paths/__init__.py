"""Geometry of paths: lines, arcs and blends of the tool, and the joints' motion along them.

Lengths along a path are in metres; a radian counts as `PER_RADIAN` metres, of the tool's turn on lines and of
the joint that turns most in joint space.
"""

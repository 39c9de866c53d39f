"""Geometry of paths: lines and arcs of the tool, blends between them, and the joints' way along them.

All lengths along a path are in metres; a turn counts as `PER_RADIAN` metres a radian, of the tool on its lines and of
the joint that turns most in joint space.
"""

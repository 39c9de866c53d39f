"""A UR robot that is moved: a program of ours on its controller follows the set-points that we write."""

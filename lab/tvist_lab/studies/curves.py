"""Curved paths: the deviation of a shaped motion from its path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tvist_lab.recordings import Floats
from tvist_lab.study.line import round_a_corner
from tvist_lab.study.method import Method, Task
from tvist_lab.study.moves import Move
from tvist_lab.study.shaping import ShaperFaultError
from tvist_plant.description import RobotDescription

CORNERS = 5
"""Number of curved paths."""


@dataclass(frozen=True)
class Bend:
    """A curved path for one method."""

    description: RobotDescription
    method: Method
    corner: tuple[Move, Move]
    """Two moves; the second starts where the first ends."""


def bends(description: RobotDescription, methods: Sequence[Method], moves: Sequence[Move]) -> list[Bend]:
    """Pair each method that shapes references with a few moves, each continued to the start of the next one."""
    paths = [
        (first, replace(second, start=first.target, target=second.start, mass=first.mass))
        for first, second in zip(moves[:CORNERS], [*moves[1:], moves[0]], strict=False)
    ]
    return [Bend(description, method, path) for method in methods if method.shapes for path in paths]


def bend(job: Bend) -> float | None:
    """Return a method's deviation from a curved path [rad]; None if it cannot be ranked."""
    first, second = job.corner
    start, corner, target = (np.array(q) for q in (first.start, first.target, second.target))
    reference = round_a_corner(start, corner, target)
    whole = Move(first.start, second.target, first.mass)
    try:
        return path_error(reference, job.method.shaped(Task(job.description, whole, reference)).q)
    except ShaperFaultError:
        return None


def path_error(path: Floats, q: Floats) -> float:
    """Largest distance of points from a path in joint space, regardless of time [rad].

    Args:
        path: Vertices of the path, shape (T, n) [rad].
        q: Points, shape (T', n) [rad].
    """
    start, way = path[:-1], np.diff(path, axis=0)
    moving = np.linalg.norm(way, axis=1) > 0.0
    start, way = start[moving], way[moving]
    square = np.sum(way**2, axis=1)
    largest = 0.0
    for point in q[::4]:
        share = np.clip(np.sum((point - start) * way, axis=1) / square, 0.0, 1.0)
        nearest = np.min(np.sum((start + share[:, None] * way - point) ** 2, axis=1))
        largest = max(largest, float(nearest))
    return math.sqrt(largest)

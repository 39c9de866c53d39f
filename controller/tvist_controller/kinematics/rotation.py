"""Rotations as matrices, shape (3, 3), and as vectors, shape (3,) [rad]."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_plant.model import Floats


@compiled_for_ticks
def turned_by(R: Floats, vector: Floats) -> None:
    """Convert a rotation matrix to a rotation vector of at most half a turn.

    The way leads over the unit quaternion (w, v), computed from the largest of its entries (Shepperd, 1978), so it is
    exact for small turns and for half turns.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]  # 4 w v
    largest = max(trace, R[0, 0], R[1, 1], R[2, 2])
    if largest == trace:
        w = 1.0 + trace  # 4 w²
    elif largest == R[0, 0]:
        w, x, y, z = x, 1.0 + 2.0 * R[0, 0] - trace, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif largest == R[1, 1]:
        w, x, y, z = y, R[0, 1] + R[1, 0], 1.0 + 2.0 * R[1, 1] - trace, R[1, 2] + R[2, 1]
    else:
        w, x, y, z = z, R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + 2.0 * R[2, 2] - trace
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(size, w) / size if size > 0.0 else 0.0
    vector[0], vector[1], vector[2] = factor * x, factor * y, factor * z


@compiled_for_ticks
def turn_into(angle: Floats, rotation: Floats, result: Floats) -> None:
    """Turn a rotation matrix about the base frame's axes by a rotation vector (Rodrigues)."""
    x, y, z = angle[0], angle[1], angle[2]
    size = math.sqrt(x * x + y * y + z * z)
    s = math.sin(size) / size if size > 1e-8 else 1.0
    half = math.sin(0.5 * size) / size if size > 1e-8 else 0.5
    c = 2.0 * half * half
    for k in range(3):
        a, b, d = rotation[0, k], rotation[1, k], rotation[2, k]
        u, v, w = y * d - z * b, z * a - x * d, x * b - y * a
        result[0, k] = a + s * u + c * (y * w - z * v)
        result[1, k] = b + s * v + c * (z * u - x * w)
        result[2, k] = d + s * w + c * (x * v - y * u)


def rotation_vector(rotation: Floats) -> list[float]:
    """Convert a rotation matrix to a rotation vector."""
    vector = np.empty(3)
    turned_by(np.ascontiguousarray(rotation), vector)
    return list(vector.tolist())


def turn(start: Floats, end: Floats) -> Floats:
    """Return the rotation vector in the base frame that turns one orientation into another, by the shortest way."""
    vector = np.empty(3)
    turned_by(np.ascontiguousarray(end @ start.T), vector)
    return vector


def turned(rotation: Floats, angle: Floats) -> Floats:
    """Return a rotation matrix turned about the base frame's axes by a rotation vector."""
    result = np.empty((3, 3))
    turn_into(angle, np.ascontiguousarray(rotation), result)
    return result

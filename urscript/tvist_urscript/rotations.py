"""Rotations as rotation vectors, by unit quaternions, which are accurate near 0 and near π."""

import math
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
"""(w, x, y, z) of length 1."""


def quaternion(rotation: Vector) -> Quaternion:
    """Return the quaternion of a rotation vector [rad]: (cos θ/2, sin(θ/2)/θ r)."""
    x, y, z = rotation
    angle = math.hypot(x, y, z)
    # sin(θ/2)/θ = 1/2 - θ²/48 + ..., whose second term is below the last bit here
    scale = math.sin(angle / 2) / angle if angle > 1e-8 else 0.5
    return (math.cos(angle / 2), x * scale, y * scale, z * scale)


def rotation_vector(turn: Quaternion) -> Vector:
    """Return the rotation vector [rad] of a quaternion, with an angle of at most π."""
    w, x, y, z = turn
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.hypot(x, y, z)
    scale = 2 * math.atan2(sine, w) / sine if sine > 1e-150 else 2.0
    return (x * scale, y * scale, z * scale)


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation b followed by a, both in fixed axes."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def inverse(a: Quaternion) -> Quaternion:
    """Return the conjugate, which turns back."""
    w, x, y, z = a
    return (w, -x, -y, -z)


def turned(a: Quaternion, v: Vector) -> Vector:
    """Return a vector that a rotation has turned: v + 2 u x (u x v + w v)."""
    w, x, y, z = a
    u = (x, y, z)
    inner = cross(u, v)
    outer = cross(u, (inner[0] + w * v[0], inner[1] + w * v[1], inner[2] + w * v[2]))
    return (v[0] + 2 * outer[0], v[1] + 2 * outer[1], v[2] + 2 * outer[2])


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by roll about x, then pitch about y, then yaw about z, all fixed axes."""
    about_x = (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
    about_y = (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
    about_z = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    return product(about_z, product(about_y, about_x))


def to_rpy(a: Quaternion) -> Vector:
    """Return roll, pitch and yaw of a rotation; roll is 0 where pitch is ±π/2 and only a sum of both is known."""
    w, x, y, z = a
    across = math.hypot(1 - 2 * (y * y + z * z), 2 * (x * y + w * z))
    pitch = math.atan2(2 * (w * y - x * z), across)
    if across < 1e-9:
        return (0.0, pitch, math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)))
    roll = math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    return (roll, pitch, math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))

"""Built-in functions of poses; rotations are unit quaternions, which are accurate near 0 and near π."""

import math
from typing import Any, TypeAlias

from tvist_urscript.costs import costs
from tvist_urscript.errors import Fault
from tvist_urscript.values import Array, Pose, Value, exactly, number, vector

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]  # (w, x, y, z) of length 1


def _parts(value: Any, what: str) -> tuple[Vector, Quaternion]:
    x, y, z, rx, ry, rz = exactly(Pose, value, what).numbers
    return (x, y, z), _turn((rx, ry, rz), what)


def _turn(rotation: Vector, what: str) -> Quaternion:
    if not math.isfinite(math.hypot(*rotation)):
        raise Fault(f"{what} has a rotation that is not finite")
    return quaternion(rotation)


def _pose(position: Vector, turn: Quaternion) -> Pose:
    return Pose((*position, *rotation_vector(turn)))


@costs(30)
def pose_trans(p_from: Value, p_from_to: Value) -> Pose:
    """Return p_from_to, given in the frame p_from, in the frame in which p_from is given."""
    (x, y, z), turn = _parts(p_from, "p_from")
    offset, inner = _parts(p_from_to, "p_from_to")
    dx, dy, dz = turned(turn, offset)
    return _pose((x + dx, y + dy, z + dz), product(turn, inner))


@costs(25)
def pose_inv(p_from: Value) -> Pose:
    """Return the pose of the base in the frame p_from."""
    (x, y, z), turn = _parts(p_from, "p_from")
    back = inverse(turn)
    return _pose(turned(back, (-x, -y, -z)), back)


@costs(30)
def pose_add(p_1: Value, p_2: Value) -> Pose:
    """Return the sum of the positions and the rotation p_2 followed by p_1: R = R_1 R_2."""
    a, turn = _parts(p_1, "p_1")
    b, second = _parts(p_2, "p_2")
    return _pose((a[0] + b[0], a[1] + b[1], a[2] + b[2]), product(turn, second))


@costs(30)
def pose_sub(p_to: Value, p_from: Value) -> Pose:
    """Return the difference of the positions and the rotation from p_from to p_to: R = R_to R_fromᵀ."""
    a, turn = _parts(p_to, "p_to")
    b, second = _parts(p_from, "p_from")
    return _pose((a[0] - b[0], a[1] - b[1], a[2] - b[2]), product(turn, inverse(second)))


@costs(5)
def pose_dist(p_from: Value, p_to: Value) -> float:
    """Return the distance of two positions [m]."""
    return math.dist(exactly(Pose, p_from, "p_from").numbers[:3], exactly(Pose, p_to, "p_to").numbers[:3])


@costs(5)
def point_dist(p_from: Value, p_to: Value) -> float:
    """Return the distance of two points [m]: poses, or lists whose first three elements are the position."""
    a, b = vector(p_from, "p_from"), vector(p_to, "p_to")
    if len(a) < 3 or len(b) < 3:
        raise Fault("point_dist needs positions of three numbers")
    return math.dist(a[:3], b[:3])


@costs(40)
def interpolate_pose(p_from: Value, p_to: Value, alpha: Value) -> Pose:
    """Return the pose at the share alpha of the line and the shortest rotation between two poses."""
    a, turn = _parts(p_from, "p_from")
    b, second = _parts(p_to, "p_to")
    share = float(number(alpha, "alpha"))
    rx, ry, rz = rotation_vector(product(second, inverse(turn)))
    step = quaternion((share * rx, share * ry, share * rz))
    x, y, z = (start + share * (end - start) for start, end in zip(a, b, strict=True))
    return _pose((x, y, z), product(step, turn))


@costs(30)
def wrench_trans(T_from_to: Value, w_from: Value) -> Array:
    """Return a wrench given at the origin of frame "from", expressed in and at the origin of frame "to".

    F' = Rᵀ F and M' = Rᵀ (M - t x F), where t and R are those of T_from_to.
    """
    offset, turn = _parts(T_from_to, "T_from_to")
    wrench = vector(w_from, "w_from")
    if len(wrench) != 6:
        raise Fault(f"w_from has to be a list of 6 numbers, not of {len(wrench)}")
    force = (wrench[0], wrench[1], wrench[2])
    lever = cross(offset, force)
    back = inverse(turn)
    moment = turned(back, (wrench[3] - lever[0], wrench[4] - lever[1], wrench[5] - lever[2]))
    return Array((*turned(back, force), *moment))


@costs(20)
def rpy2rotvec(rpy_vector: Value) -> Array:
    """Return the rotation vector of roll, pitch and yaw [rad] about fixed axes."""
    return Array(rotation_vector(from_rpy(*_three(rpy_vector, "rpy_vector"))))


@costs(20)
def rotvec2rpy(rotation_vector: Value) -> Array:
    """Return roll, pitch and yaw [rad] about fixed axes."""
    return Array(to_rpy(_turn(_three(rotation_vector, "rotation_vector"), "rotation_vector")))


def _three(value: Value, what: str) -> Vector:
    numbers = vector(value, what)
    if len(numbers) != 3:
        raise Fault(f"{what} has to be a list of 3 numbers, not of {len(numbers)}")
    if not all(map(math.isfinite, numbers)):
        raise Fault(f"{what} has to consist of finite numbers")
    return (numbers[0], numbers[1], numbers[2])


def quaternion(rotation: Vector) -> Quaternion:
    """Return the quaternion of a rotation vector [rad]: (cos θ/2, sin(θ/2)/θ r)."""
    x, y, z = rotation
    angle = math.hypot(x, y, z)
    # sin(θ/2)/θ = 1/2 - θ²/48 + ...; below this angle, the second term is below the last bit
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
    """Return the rotation b followed by a, both about fixed axes."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def inverse(a: Quaternion) -> Quaternion:
    """Return the conjugate, which is the inverse rotation."""
    w, x, y, z = a
    return (w, -x, -y, -z)


def turned(a: Quaternion, v: Vector) -> Vector:
    """Rotate a vector: v + 2 u x (u x v + w v)."""
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
    """Return roll, pitch and yaw [rad]; if pitch is ±π/2, only their sum is determined, and roll is 0."""
    w, x, y, z = a
    across = math.hypot(1 - 2 * (y * y + z * z), 2 * (x * y + w * z))
    pitch = math.atan2(2 * (w * y - x * z), across)
    if across < 1e-9:
        return (0.0, pitch, math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)))
    roll = math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    return (roll, pitch, math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)))

"""Rotations, forward kinematics of a chain, and joint positions nearby for a pose.

Rotations are matrices (3, 3) or vectors (3,) [rad]. Kernels can be called from other compiled functions;
their arrays are C-contiguous 64-bit floats.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from tvist_controller._compiled import compiled, compiled_for_ticks
from tvist_plant.chain import bend, start, step_along
from tvist_plant.model import Floats

LOST = 1e-4  # singular value of the Jacobian below which its direction counts as lost [m or rad per rad]
SWEEPS = 15  # largest number of sweeps over all pairs of rows; seven have always been enough
ACCURATE = 1e-12  # pose error at which Newton's method stops [m or rad]


@compiled_for_ticks
def turned_by(R: Floats, vector: Floats) -> None:
    """Convert a rotation matrix to a rotation vector of at most half a turn.

    Uses the unit quaternion computed from its largest entry (Shepperd, 1978), so small turns and half turns are exact.
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
    """Rotate a rotation matrix about the base frame's axes by a rotation vector (Rodrigues)."""
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
    """Return the rotation vector, in the base frame, of the shortest turn from one orientation to another."""
    vector = np.empty(3)
    turned_by(np.ascontiguousarray(end @ start.T), vector)
    return vector


def turned(rotation: Floats, angle: Floats) -> Floats:
    """Return a rotation matrix turned about the base frame's axes by a rotation vector."""
    result = np.empty((3, 3))
    turn_into(angle, np.ascontiguousarray(rotation), result)
    return result


@compiled
def locate(chain: Floats, q: Floats, R: Floats, o: Floats, J: Floats) -> None:
    """Compute rotation (3, 3), position (3,) [m] and Jacobian (6, n) of a chain's end; linear rows come first."""
    n = q.shape[0]
    start(R, o)
    for j in range(n):
        step_along(chain[j], R, o)
        bend(R, q[j])
        # Until the end is known, each column holds the joint's axis and a point on it instead of the lever arm.
        for k in range(3):
            J[k, j], J[3 + k, j] = o[k], R[k, 2]
    step_along(chain[n], R, o)
    for j in range(n):
        lx, ly, lz = o[0] - J[0, j], o[1] - J[1, j], o[2] - J[2, j]
        ax, ay, az = J[3, j], J[4, j], J[5, j]
        J[0, j] = ay * lz - az * ly
        J[1, j] = az * lx - ax * lz
        J[2, j] = ax * ly - ay * lx


@compiled
def pose_error(
    rotation: Floats, position: Floats, now: Floats, place: Floats, error: Floats
) -> tuple[float, float]:
    """Compute translation [m] and rotation vector [rad] between two poses, (6,); return their lengths."""
    D = np.empty((3, 3))
    for i in range(3):
        error[i] = position[i] - place[i]
        for j in range(3):
            D[i, j] = rotation[i, 0] * now[j, 0] + rotation[i, 1] * now[j, 1] + rotation[i, 2] * now[j, 2]
    turned_by(D, error[3:])
    far = math.sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2])
    return far, math.sqrt(error[3] * error[3] + error[4] * error[4] + error[5] * error[5])


@compiled
def pseudo_inverse(jacobian: Floats, inverse: Floats) -> None:  # noqa: C901, PLR0912  a kernel: its branches are loops
    """Compute the pseudo-inverse (n, 6) of a Jacobian; it is zero in lost directions (Hestenes, 1958).

    Not numba's own decomposition, because that needs scipy, which a served robot does without.
    """
    n = jacobian.shape[1]
    W, V = jacobian.copy(), np.eye(6)
    for _ in range(SWEEPS):
        turned = False
        for i in range(5):
            for j in range(i + 1, 6):
                a, b, c = 0.0, 0.0, 0.0
                for k in range(n):
                    a, b, c = a + W[i, k] * W[i, k], b + W[j, k] * W[j, k], c + W[i, k] * W[j, k]
                if c * c <= 1e-28 * a * b or min(a, b) < 1e-20:
                    continue
                turned = True
                zeta = (b - a) / (2.0 * c)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / math.sqrt(1.0 + t * t)
                sine = cosine * t
                for k in range(n):
                    W[i, k], W[j, k] = cosine * W[i, k] - sine * W[j, k], sine * W[i, k] + cosine * W[j, k]
                for k in range(6):
                    V[i, k], V[j, k] = cosine * V[i, k] - sine * V[j, k], sine * V[i, k] + cosine * V[j, k]
        if not turned:
            break
    inverse[:] = 0.0
    for i in range(6):
        square = 0.0
        for k in range(n):
            square += W[i, k] * W[i, k]
        if square > LOST * LOST:
            for k in range(n):
                for m in range(6):
                    inverse[k, m] += W[i, k] * V[i, m] / square


@compiled
def newton(
    chain: Floats,
    rotation: Floats,  # to reach, like the position
    position: Floats,
    inverse: Floats,
    steps: int,
    q: Floats,  # start, which becomes the result
    error: Floats,  # result: remaining error, shape (6,) [m, rad]
) -> float:
    """Bring a chain's end to a pose by Newton's method with a nearby inverse Jacobian (n, 6).

    Directions that the inverse lacks stay unchanged, so no joint turns far at a singularity. Return the
    largest error entry.
    """
    n, off = q.shape[0], 0.0
    R, o, J = np.empty((3, 3)), np.empty(3), np.empty((6, n))
    for step in range(steps + 1):
        locate(chain, q, R, o, J)
        pose_error(rotation, position, R, o, error)
        off = 0.0
        for m in range(6):
            off = max(off, abs(error[m]))
        if off <= ACCURATE or step == steps:
            break
        for i in range(n):
            for m in range(6):
                q[i] += inverse[i, m] * error[m]
    return off


class Placement(NamedTuple):
    """A pose: rotation matrix, shape (3, 3), and position, shape (3,) [m]."""

    rotation: Floats
    position: Floats

    def __matmul__(self, other: "Placement") -> "Placement":
        return Placement(self.rotation @ other.rotation, self.rotation @ other.position + self.position)

    @property
    def inverse(self) -> "Placement":
        """The inverse pose: of this pose's reference frame in its own frame."""
        back = self.rotation.T
        return Placement(back, -back @ self.position)

    @property
    def vector(self) -> tuple[float, float, float, float, float, float]:
        """Position x y z [m] and rotation vector [rad]."""
        return placement_vector(*self)


def placement_vector(rotation: Floats, position: Floats) -> tuple[float, float, float, float, float, float]:
    """Return x y z [m] and rotation vector [rad] of a rotation matrix and a position."""
    x, y, z = position.tolist()
    rx, ry, rz = np.asarray(pin.log3(rotation)).tolist()
    return x, y, z, rx, ry, rz


def placement(pose: Sequence[float] | None) -> Placement:
    """Return the placement of a pose message; the identity for None."""
    if pose is None:
        return Placement(np.eye(3), np.zeros(3))
    return Placement(np.asarray(pin.exp3(np.array(pose[3:], dtype=float))), np.array(pose[:3], dtype=float))

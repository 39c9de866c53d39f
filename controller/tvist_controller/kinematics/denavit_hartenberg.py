"""Pose of the tool, its Jacobian and the Jacobian's rate, from the frames of its links.

Joint i turns about z by q_i and is followed by Tz(d_i) Tx(a_i) Rx(α_i), or by a placement of its own. A kernel takes
these numbers as the table of `dh_table`, and the tool centre point as rotation and position in the flange frame.
Everything is in the base frame: vectors at the tool centre point have the base's axes, as pinocchio's
LOCAL_WORLD_ALIGNED. All kernels can be called from other compiled functions; arrays are C-contiguous and of 64-bit
floats.
"""

import math

import numpy as np
import numpy.typing as npt

from tvist_controller._compiled import compiled
from tvist_plant.description import RobotDescription
from tvist_plant.model import link_frame

Floats = npt.NDArray[np.float64]

PLACED = 5
"""Column at which the placement of a link begins; a narrower table has none."""


def dh_table(description: RobotDescription) -> Floats:
    """Return a, d [m], cos α and sin α of each joint, shape (n, 4).

    For an arm with placements, the shape is (n, 17): five columns that kernels of this module do not use, then the
    rotation by rows and the position [m] of the frame at the link's end.
    """
    if description.kinematics.placement:
        frames = [link_frame(description, number) for number in range(description.joints)]
        return np.array([[*[0.0] * PLACED, *frame.rotation.ravel(), *frame.translation] for frame in frames])
    a, d, alpha = (
        np.array(values, dtype=float)
        for values in (description.kinematics.a, description.kinematics.d, description.kinematics.alpha)
    )
    return np.column_stack((a, d, np.cos(alpha), np.sin(alpha)))


@compiled
def _at_end(
    L: Floats,
    xx: float, xy: float, xz: float, yx: float, yy: float, yz: float, zx: float, zy: float, zz: float,
) -> tuple[float, ...]:  # fmt: skip
    """Return the way [m] to the end of a link with a placement, and the axes of the frame there.

    L has the placement's rotation by rows and its position [m], shape (12,); the rest are the axes of the joint's frame
    after it has turned.
    """
    return (
        L[9] * xx + L[10] * yx + L[11] * zx, L[9] * xy + L[10] * yy + L[11] * zy, L[9] * xz + L[10] * yz + L[11] * zz,
        L[0] * xx + L[3] * yx + L[6] * zx, L[0] * xy + L[3] * yy + L[6] * zy, L[0] * xz + L[3] * yz + L[6] * zz,
        L[1] * xx + L[4] * yx + L[7] * zx, L[1] * xy + L[4] * yy + L[7] * zy, L[1] * xz + L[4] * yz + L[7] * zz,
        L[2] * xx + L[5] * yx + L[8] * zx, L[2] * xy + L[5] * yy + L[8] * zy, L[2] * xz + L[5] * yz + L[8] * zz,
    )  # fmt: skip


@compiled
def kinematics_into(
    dh: Floats,
    tool_rotation: Floats,
    tool_position: Floats,
    q: Floats,
    rotation: Floats,
    position: Floats,
    jacobian: Floats,
) -> None:
    """Compute the tool's pose and Jacobian as `kinematics` does, into arrays that the caller has made.

    Args:
        dh: Table of `dh_table`, shape (n, 4).
        tool_rotation: Rotation of the tool in the flange frame, shape (3, 3).
        tool_position: Tool centre point in the flange frame, shape (3,) [m].
        q: Joint positions, shape (n,) [rad].
        rotation: Result, shape (3, 3).
        position: Result, shape (3,) [m].
        jacobian: Result, shape (6, n).
    """
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px, py, pz = 0.0, 0.0, 0.0
    joints, placed = dh.shape[0], dh.shape[1] > PLACED
    for i in range(joints):
        # Each column holds the joint's axis, and a point on it in place of the lever, until the tool is known.
        jacobian[0, i], jacobian[1, i], jacobian[2, i] = px, py, pz
        jacobian[3, i], jacobian[4, i], jacobian[5, i] = zx, zy, zz
        if placed:
            c, s = math.cos(q[i]), math.sin(q[i])
            ux, uy, uz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
            vx, vy, vz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
            L = dh[i, PLACED:]
            lx, ly, lz, xx, xy, xz, yx, yy, yz, zx, zy, zz = _at_end(L, ux, uy, uz, vx, vy, vz, zx, zy, zz)
            px, py, pz = px + lx, py + ly, pz + lz
            continue
        a, d, ca, sa = dh[i, 0], dh[i, 1], dh[i, 2], dh[i, 3]
        c, s = math.cos(q[i]), math.sin(q[i])
        ux, uy, uz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
        xx, xy, xz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
        px, py, pz = px + a * xx + d * zx, py + a * xy + d * zy, pz + a * xz + d * zz
        yx, yy, yz = ca * ux + sa * zx, ca * uy + sa * zy, ca * uz + sa * zz
        zx, zy, zz = ca * zx - sa * ux, ca * zy - sa * uy, ca * zz - sa * uz
    tx, ty, tz = tool_position[0], tool_position[1], tool_position[2]
    position[0] = px + tx * xx + ty * yx + tz * zx
    position[1] = py + tx * xy + ty * yy + tz * zy
    position[2] = pz + tx * xz + ty * yz + tz * zz
    for k in range(3):
        tx, ty, tz = tool_rotation[0, k], tool_rotation[1, k], tool_rotation[2, k]
        rotation[0, k] = tx * xx + ty * yx + tz * zx
        rotation[1, k] = tx * xy + ty * yy + tz * zy
        rotation[2, k] = tx * xz + ty * yz + tz * zz
    for i in range(joints):
        lx, ly, lz = position[0] - jacobian[0, i], position[1] - jacobian[1, i], position[2] - jacobian[2, i]
        ax, ay, az = jacobian[3, i], jacobian[4, i], jacobian[5, i]
        jacobian[0, i] = ay * lz - az * ly
        jacobian[1, i] = az * lx - ax * lz
        jacobian[2, i] = ax * ly - ay * lx


@compiled
def kinematics(
    dh: Floats, tool_rotation: Floats, tool_position: Floats, q: Floats
) -> tuple[Floats, Floats, Floats]:
    """Compute pose and geometric Jacobian of the tool.

    Args:
        dh: Table of `dh_table`, shape (n, 4).
        tool_rotation: Rotation of the tool in the flange frame, shape (3, 3).
        tool_position: Tool centre point in the flange frame, shape (3,) [m].
        q: Joint positions, shape (n,) [rad].

    Returns:
        Rotation of the tool, shape (3, 3); tool centre point, shape (3,) [m]; Jacobian, shape (6, n), whose product
        with q̇ is the linear velocity of the tool centre point [m/s] followed by the angular velocity [rad/s].
    """
    rotation, position = np.empty((3, 3)), np.empty(3)
    jacobian = np.empty((6, dh.shape[0]))
    kinematics_into(dh, tool_rotation, tool_position, q, rotation, position, jacobian)
    return rotation, position, jacobian


@compiled
def bias_into(dh: Floats, tool_position: Floats, q: Floats, qd: Floats, result: Floats) -> None:
    """Compute J̇ q̇ as `bias` does, into `result`, shape (6,)."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    wx, wy, wz = 0.0, 0.0, 0.0  # angular velocity
    ex, ey, ez = 0.0, 0.0, 0.0  # angular acceleration
    ax, ay, az = 0.0, 0.0, 0.0  # acceleration of the frame's origin
    joints, placed = dh.shape[0], dh.shape[1] > PLACED
    for i in range(joints):
        a, d, ca, sa = dh[i, 0], dh[i, 1], dh[i, 2], dh[i, 3]
        c, s, rate = math.cos(q[i]), math.sin(q[i]), qd[i]
        ex, ey, ez = (
            ex + rate * (wy * zz - wz * zy),
            ey + rate * (wz * zx - wx * zz),
            ez + rate * (wx * zy - wy * zx),
        )
        wx, wy, wz = wx + rate * zx, wy + rate * zy, wz + rate * zz
        if placed:
            L = dh[i, PLACED:]
            ux, uy, uz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
            vx, vy, vz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
            lx, ly, lz, xx, xy, xz, yx, yy, yz, zx, zy, zz = _at_end(L, ux, uy, uz, vx, vy, vz, zx, zy, zz)
        else:
            ux, uy, uz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
            xx, xy, xz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
            lx, ly, lz = a * xx + d * zx, a * xy + d * zy, a * xz + d * zz
            yx, yy, yz = ca * ux + sa * zx, ca * uy + sa * zy, ca * uz + sa * zz
            zx, zy, zz = ca * zx - sa * ux, ca * zy - sa * uy, ca * zz - sa * uz
        if i == joints - 1:
            tx, ty, tz = tool_position[0], tool_position[1], tool_position[2]
            lx += tx * xx + ty * yx + tz * zx
            ly += tx * xy + ty * yy + tz * zy
            lz += tx * xz + ty * yz + tz * zz
        vx, vy, vz = wy * lz - wz * ly, wz * lx - wx * lz, wx * ly - wy * lx
        ax += ey * lz - ez * ly + wy * vz - wz * vy
        ay += ez * lx - ex * lz + wz * vx - wx * vz
        az += ex * ly - ey * lx + wx * vy - wy * vx
    result[0], result[1], result[2], result[3], result[4], result[5] = ax, ay, az, ex, ey, ez


@compiled
def bias(dh: Floats, tool_position: Floats, q: Floats, qd: Floats) -> Floats:
    """Compute J̇ q̇, the tool's acceleration at constant joint velocities; in full it is J q̈ + J̇ q̇.

    Args:
        dh: Table of `dh_table`, shape (n, 4).
        tool_position: Tool centre point in the flange frame, shape (3,) [m].
        q: Joint positions, shape (n,) [rad].
        qd: Joint velocities, shape (n,) [rad/s].

    Returns:
        Linear [m/s^2] and angular [rad/s^2] acceleration, shape (6,).
    """
    result = np.empty(6)
    bias_into(dh, tool_position, q, qd, result)
    return result

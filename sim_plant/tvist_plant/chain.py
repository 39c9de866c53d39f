"""Dynamics of a serial chain of revolute joints, compiled.

All vectors are in the axes of the base and refer to its origin, so that bodies are added without moving them
(Featherstone 2008, ch. 5 and 6; pinocchio calls this convention WORLD). With S_j the twist of a unit velocity of joint
j, V and A the twist of body i and its derivative, and I_i its inertia,

    V_i = V_{i-1} + S_i q̇_i,    A_i = A_{i-1} + S_i q̈_i + V_{i-1} x S_i q̇_i,    F_i = I_i A_i + V_i x* I_i V_i
    τ_j = S_jᵀ Σ_{i>=j} F_i,    M_jk = S_jᵀ (Σ_{i>=k} I_i) S_k for j <= k

The base accelerates upwards at g, which loads the arm as gravity does.
"""

import math

import numpy as np
import pinocchio as pin

from tvist_kernels.compiling import compiled
from tvist_plant.model import Floats

AXES = {
    "JointModelRX": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "JointModelRY": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "JointModelRZ": np.eye(3),
}
"""Rotation that turns z into the axis of each kind of joint."""
TURN, SHIFT, BODY, WIDTH = 0, 9, 12, 22
"""Columns of a chain's row: rotation, translation and inertia of a link; the number of columns."""
SCRATCH = 28  # columns of the scratch: twist (6), inertia (10), velocity (6), acceleration or force (6)


def chain_of(model: pin.Model, frame: int) -> Floats:
    """Return the parameters of a chain of revolute joints up to a frame on the last one, shape (N+1, 22).

    A row holds the rotation (9) and translation (3) of a joint's frame, with z as its axis, relative to the
    previous joint, and its body's ten inertial parameters in pinocchio's order [kg, kg m, kg m^2]. The last
    row is the end frame.
    """
    links = model.nv
    chain = np.zeros((links + 1, WIDTH))
    aligned = pin.SE3.Identity()
    for number in range(1, links + 1):
        turned = pin.SE3(AXES[model.joints[number].shortname()], np.zeros(3))
        placement = aligned.inverse() * model.jointPlacements[number] * turned
        _place(chain[number - 1], placement)
        chain[number - 1, BODY:] = body_of(model, number)
        aligned = turned
    _place(chain[links], aligned.inverse() * model.frames[frame].placement)
    return chain


def body_of(model: pin.Model, number: int) -> Floats:
    """Return the ten inertial parameters of a joint's body, as in a row of `chain_of`."""
    turned = pin.SE3(AXES[model.joints[number].shortname()], np.zeros(3))
    return np.asarray(turned.inverse().act(model.inertias[number]).toDynamicParameters())


def _place(row: Floats, placement: pin.SE3) -> None:
    row[TURN:SHIFT], row[SHIFT:BODY] = placement.rotation.ravel(), placement.translation


@compiled
def turn(R: Floats, row: Floats) -> None:
    """Multiply the rotation R from the right by the rotation in a link's row, in place."""
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        R[i, 0] = x * row[0] + y * row[3] + z * row[6]
        R[i, 1] = x * row[1] + y * row[4] + z * row[7]
        R[i, 2] = x * row[2] + y * row[5] + z * row[8]


@compiled
def step_along(row: Floats, R: Floats, o: Floats) -> None:
    """Move a frame with rotation R and origin o by the placement of a link."""
    for i in range(3):
        o[i] += R[i, 0] * row[9] + R[i, 1] * row[10] + R[i, 2] * row[11]
    turn(R, row)


@compiled
def bend(R: Floats, angle: float) -> None:
    """Turn the frame R about its z axis."""
    c, s = math.cos(angle), math.sin(angle)
    for i in range(3):
        x, y = R[i, 0], R[i, 1]
        R[i, 0] = c * x + s * y
        R[i, 1] = c * y - s * x


@compiled
def start(R: Floats, o: Floats) -> None:
    """Put a frame at the base."""
    for i in range(3):
        o[i] = 0.0
        for j in range(3):
            R[i, j] = 1.0 if i == j else 0.0


@compiled
def twist(R: Floats, o: Floats, S: Floats) -> None:
    """Compute the twist of unit velocity about a frame's z axis: angular, then linear at the base origin."""
    x, y, z = R[0, 2], R[1, 2], R[2, 2]
    S[0], S[1], S[2] = x, y, z
    S[3], S[4], S[5] = o[1] * z - o[2] * y, o[2] * x - o[0] * z, o[0] * y - o[1] * x


@compiled
def placed(row: Floats, R: Floats, o: Floats, inertia: Floats) -> None:
    """Compute the inertial parameters of a link's body in base axes about the base origin, shape (10,)."""
    m, hx, hy, hz = row[12], row[13], row[14], row[15]
    xx, xy, yy, xz, yz, zz = row[16], row[17], row[18], row[19], row[20], row[21]
    # About the body's own frame, in the axes of the base: R I Rᵀ.
    a0 = R[0, 0] * xx + R[0, 1] * xy + R[0, 2] * xz
    a1 = R[0, 0] * xy + R[0, 1] * yy + R[0, 2] * yz
    a2 = R[0, 0] * xz + R[0, 1] * yz + R[0, 2] * zz
    b0 = R[1, 0] * xx + R[1, 1] * xy + R[1, 2] * xz
    b1 = R[1, 0] * xy + R[1, 1] * yy + R[1, 2] * yz
    b2 = R[1, 0] * xz + R[1, 1] * yz + R[1, 2] * zz
    c0 = R[2, 0] * xx + R[2, 1] * xy + R[2, 2] * xz
    c1 = R[2, 0] * xy + R[2, 1] * yy + R[2, 2] * yz
    c2 = R[2, 0] * xz + R[2, 1] * yz + R[2, 2] * zz
    x = R[0, 0] * hx + R[0, 1] * hy + R[0, 2] * hz
    y = R[1, 0] * hx + R[1, 1] * hy + R[1, 2] * hz
    z = R[2, 0] * hx + R[2, 1] * hy + R[2, 2] * hz
    p, q, r = o[0], o[1], o[2]
    # Moved to the base's origin: I + 2 (o·h) E - o hᵀ - h oᵀ + m (o·o E - o oᵀ).
    px, qy, rz = p * x, q * y, r * z
    inertia[0] = m
    inertia[1], inertia[2], inertia[3] = x + m * p, y + m * q, z + m * r
    inertia[4] = a0 * R[0, 0] + a1 * R[0, 1] + a2 * R[0, 2] + 2.0 * (qy + rz) + m * (q * q + r * r)
    inertia[5] = a0 * R[1, 0] + a1 * R[1, 1] + a2 * R[1, 2] - p * y - q * x - m * p * q
    inertia[6] = b0 * R[1, 0] + b1 * R[1, 1] + b2 * R[1, 2] + 2.0 * (px + rz) + m * (p * p + r * r)
    inertia[7] = a0 * R[2, 0] + a1 * R[2, 1] + a2 * R[2, 2] - p * z - r * x - m * p * r
    inertia[8] = b0 * R[2, 0] + b1 * R[2, 1] + b2 * R[2, 2] - q * z - r * y - m * q * r
    inertia[9] = c0 * R[2, 0] + c1 * R[2, 1] + c2 * R[2, 2] + 2.0 * (px + qy) + m * (p * p + q * q)


@compiled
def momentum(I: Floats, V: Floats) -> tuple[float, float, float, float, float, float]:
    """Return inertia times a twist or a twist's derivative: moment about the base origin, then force."""
    m, hx, hy, hz = I[0], I[1], I[2], I[3]
    a, b, c, u, v, w = V[0], V[1], V[2], V[3], V[4], V[5]
    return (
        I[4] * a + I[5] * b + I[7] * c + hy * w - hz * v,
        I[5] * a + I[6] * b + I[8] * c + hz * u - hx * w,
        I[7] * a + I[8] * b + I[9] * c + hx * v - hy * u,
        m * u + b * hz - c * hy,
        m * v + c * hx - a * hz,
        m * w + a * hy - b * hx,
    )


@compiled
def sweep(chain: Floats, q: Floats, qd: Floats, qdd: Floats, gravity: float, scratch: Floats) -> None:
    """Compute twist S, inertia, velocity V and force F of each body, from the base to the end.

    For the scratch's columns see `SCRATCH`; the last row holds the last body's acceleration, not a force.
    """
    R, o, A = np.empty((3, 3)), np.empty(3), np.empty(6)
    start(R, o)
    for k in range(6):
        A[k] = 0.0
    A[5] = gravity
    a = b = c = u = v = w = 0.0
    for i in range(q.shape[0]):
        row, body = chain[i], scratch[i]
        S, inertia, V, F = body[:6], body[6:16], body[16:22], body[22:28]
        step_along(row, R, o)
        bend(R, q[i])
        twist(R, o, S)
        placed(row, R, o, inertia)
        rate, rise = qd[i], qdd[i]
        A[0] += S[0] * rise + (b * S[2] - c * S[1]) * rate
        A[1] += S[1] * rise + (c * S[0] - a * S[2]) * rate
        A[2] += S[2] * rise + (a * S[1] - b * S[0]) * rate
        A[3] += S[3] * rise + (b * S[5] - c * S[4] + v * S[2] - w * S[1]) * rate
        A[4] += S[4] * rise + (c * S[3] - a * S[5] + w * S[0] - u * S[2]) * rate
        A[5] += S[5] * rise + (a * S[4] - b * S[3] + u * S[1] - v * S[0]) * rate
        a, b, c = a + S[0] * rate, b + S[1] * rate, c + S[2] * rate
        u, v, w = u + S[3] * rate, v + S[4] * rate, w + S[5] * rate
        V[0], V[1], V[2], V[3], V[4], V[5] = a, b, c, u, v, w
        n0, n1, n2, f0, f1, f2 = momentum(inertia, V)
        t0, t1, t2, g0, g1, g2 = momentum(inertia, A)
        F[0] = t0 + b * n2 - c * n1 + v * f2 - w * f1
        F[1] = t1 + c * n0 - a * n2 + w * f0 - u * f2
        F[2] = t2 + a * n1 - b * n0 + u * f1 - v * f0
        F[3] = g0 + b * f2 - c * f1
        F[4] = g1 + c * f0 - a * f2
        F[5] = g2 + a * f1 - b * f0
    last = q.shape[0]
    end = scratch[last]
    step_along(chain[last], R, o)
    for i in range(3):
        for j in range(3):
            end[3 * i + j] = R[i, j]
        end[9 + i] = o[i]
    end[16], end[17], end[18], end[19], end[20], end[21] = a, b, c, u, v, w
    for k in range(6):
        end[22 + k] = A[k]


@compiled
def along(S: Floats, F: Floats) -> float:
    """Return the power of a wrench along a twist."""
    return float(S[0] * F[0] + S[1] * F[1] + S[2] * F[2] + S[3] * F[3] + S[4] * F[4] + S[5] * F[5])


@compiled
def collect_torques(scratch: Floats, torque: Floats) -> None:
    """Compute joint torques after a sweep [N m]; each F in the scratch then includes all outer bodies' F."""
    for i in range(torque.shape[0] - 1, -1, -1):
        F = scratch[i, 22:28]
        torque[i] = along(scratch[i, :6], F)
        if i > 0:
            for k in range(6):
                scratch[i - 1, 22 + k] += F[k]


@compiled
def collect_gravity(scratch: Floats, gravity: float, torque: Floats) -> None:
    """Compute the joint torques that balance gravity, after a sweep with any velocities, shape (N,) [N m]."""
    m = x = y = 0.0
    for j in range(torque.shape[0] - 1, -1, -1):
        row = scratch[j]
        m, x, y = m + row[6], x + row[7], y + row[8]
        torque[j] = gravity * (row[0] * y - row[1] * x + row[5] * m)


@compiled
def collect_inertia(scratch: Floats, M: Floats) -> None:
    """Compute M's upper triangle after a sweep [kg m²]; inertias in `scratch` then cover all outer bodies."""
    W = np.empty(6)
    for k in range(M.shape[0] - 1, -1, -1):
        inertia = scratch[k, 6:16]
        W[0], W[1], W[2], W[3], W[4], W[5] = momentum(inertia, scratch[k, :6])
        for j in range(k + 1):
            M[j, k] = along(scratch[j, :6], W)
        if k > 0:
            for e in range(10):
                scratch[k - 1, 6 + e] += inertia[e]


@compiled
def torques(
    chain: Floats, q: Floats, qd: Floats, qdd: Floats, gravity: float, scratch: Floats, torque: Floats
) -> None:
    """Compute inverse dynamics, τ = M(q) q̈ + C(q, q̇) q̇ + g(q), shape (N,) [N m], as `sweep`."""
    sweep(chain, q, qd, qdd, gravity, scratch)
    collect_torques(scratch, torque)

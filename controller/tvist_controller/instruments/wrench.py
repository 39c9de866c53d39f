"""The wrench at the tool: the external force and torque, estimated from the drives' torques."""

import math
from collections.abc import Sequence

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.instruments.joint_lists import (
    ACTUAL_MOMENT,
    ACTUAL_Q,
    ROWS,
    SHAPED_MOMENT,
    SHAPED_QD,
    SHAPED_QDD,
    as_rows,
    joint_lists,
)
from tvist_controller.kinematics.elimination import eliminate
from tvist_plant.chain import bend, chain_of, start, step_along, twist
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, Floats, rigid_model
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

NEAR_SINGULAR = 0.01
"""Manipulability √det(J Jᵀ) below which forces are damped; a UR5e reaches 0.11 [m³ with six joints]."""
DAMPING = 0.08
"""λ₀, the damping factor at a singular posture [m, or -]."""
RUNNING = int(RobotMode.RUNNING)
"""Robot mode in which the drives hold the arm, as a plain integer, since it is compared often."""


def since_zeroed(wrench: list[float], zero: list[float] | None) -> list[float]:
    """Return a wrench relative to the one that a program has taken as zero, if there is one [N, N m]."""
    return wrench if zero is None else [felt - none for felt, none in zip(wrench, zero, strict=True)]


@compiled_for_ticks
def determinant(A: Floats) -> float:
    """Determinant of a matrix, shape (n, n), by elimination with pivots; the matrix is used up."""
    n, found = A.shape[0], 1.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[pivot, k]):
                pivot = i
        if A[pivot, k] == 0.0:
            return 0.0
        if pivot != k:
            found = -found
            for j in range(k, n):
                A[k, j], A[pivot, j] = A[pivot, j], A[k, j]
        found *= A[k, k]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= factor * A[k, j]
    return found


@compiled_for_ticks
def jacobian_at(chain: Floats, offset: Floats, q: Floats, J: Floats) -> None:
    """Jacobian of a point that is fixed to the end of a chain: translation, then rotation, base frame, shape (6, n)."""
    R, o, S = np.empty((3, 3)), np.empty(3), np.empty(6)
    start(R, o)
    n = q.shape[0]
    for j in range(n):
        step_along(chain[j], R, o)
        bend(R, q[j])
        twist(R, o, S)
        for k in range(3):
            J[k, j], J[3 + k, j] = S[3 + k], S[k]
    step_along(chain[n], R, o)
    for k in range(3):
        o[k] += R[k, 0] * offset[0] + R[k, 1] * offset[1] + R[k, 2] * offset[2]
    for j in range(n):
        J[0, j] += J[4, j] * o[2] - J[5, j] * o[1]
        J[1, j] += J[5, j] * o[0] - J[3, j] * o[2]
        J[2, j] += J[3, j] * o[1] - J[4, j] * o[0]


@compiled_for_ticks
def product(A: Floats, B: Floats) -> Floats:
    """Product of two small matrices."""
    found = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                found[i, j] += A[i, k] * B[k, j]
    return found


@compiled_for_ticks
def force_at(chain: Floats, offset: Floats, q: Floats, torque: Floats, force: Floats) -> None:
    """Compute the force that causes torques; see `ToolWrench.estimate`.

    Args:
        chain: The links, see `tvist_plant.chain`, shape (n+1, 22).
        offset: Point in the frame of the end, shape (3,) [m].
        q: Joint positions, shape (n,) [rad].
        torque: Torques on the joints, shape (n,) [N m].
        force: Result: force and torque, shape (6,) [N, N m].
    """
    n = q.shape[0]
    J = np.empty((6, n))
    jacobian_at(chain, offset, q, J)
    square = product(J.T, J) if n <= 6 else product(J, J.T)
    manipulability = math.sqrt(max(determinant(square.copy()), 0.0))
    if manipulability < NEAR_SINGULAR:
        damping = DAMPING * (1.0 - manipulability / NEAR_SINGULAR)
        for k in range(square.shape[0]):
            square[k, k] += damping * damping
    known = torque.copy() if n <= 6 else product(J, torque.reshape(n, 1))[:, 0].copy()
    eliminate(square, known)
    for k in range(6):
        force[k] = known[k]
        if n <= 6:
            force[k] = 0.0
            for j in range(n):
                force[k] += J[k, j] * known[j]


@compiled_for_ticks
def estimate(
    chain: Floats, offset: Floats, motion: Floats, drives: Floats, slip: Floats, out: Floats
) -> None:
    """Estimate what acts on the arm from outside; see `ToolWrench.estimate`.

    Args:
        chain: The links, see `tvist_plant.chain`, shape (n+1, 22).
        offset: Point in the frame of the end, shape (3,) [m].
        motion: See `joint_lists`, shape (10, n).
        drives: Inertia of the rotors [kg m²] and Coulomb friction [N m], shape (2, n).
        slip: Share of the friction that acts, shape (n,) [-].
        out: Result: force and torque at the point [N, N m], then torques on the joints [N m], shape (6 + n,).
    """
    for j in range(slip.shape[0]):
        expected = motion[SHAPED_MOMENT, j] + drives[0, j] * motion[SHAPED_QDD, j] + drives[1, j] * slip[j]
        out[6 + j] = expected - motion[ACTUAL_MOMENT, j]
    force_at(chain, offset, motion[ACTUAL_Q], out[6:], out[:6])


class ToolWrench:
    """Estimates the force at the tool centre point that explains the measured torques.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        model = rigid_model(description, Payload())
        self._chain = chain_of(model, model.getFrameId(FLANGE))
        drives = description.drives
        self._drives = np.array([drives.rotor_inertia, drives.coulomb_friction])
        self._width, self._linear = drives.friction_width, drives.linear_friction
        self._offset, self._point = [0.0] * 6, np.zeros(3)
        # Loads compiled code, which takes many ticks.
        self.estimate(np.zeros((ROWS, description.joints)), self._offset)

    def estimate(self, motion: Floats, offset: Sequence[float]) -> Floats:
        """Return force and torque at the tool centre point, base frame [N, N m], and torques on the joints [N m].

        External torques on the joints are the torques of drives that follow their target (rigid arm with the declared
        payload, rotors and friction), minus the measured torques.

        F with Jᵀ F = τ by damped least squares, F = J (Jᵀ J + λ² 1)⁻¹ τ, with λ = λ₀ (1 - w/w₀) if the manipulability
        w is below w₀ (Nakamura and Hanafusa, 1986). Components that affect no joint are zero.

        Args:
            motion: See `joint_lists`, shape (10, n).
            offset: Tool centre point in the flange frame [m, rad].

        Returns:
            Shape (6 + n,).
        """
        if offset != self._offset:
            self._offset, self._point = list(offset), np.array(offset[:3])
        share = motion[SHAPED_QD] / self._width
        out = np.empty(6 + len(share))
        slip = share if self._linear else np.tanh(share)
        estimate(self._chain, self._point, motion, self._drives, slip, out)
        return out

    def of(self, state: State, offset: Sequence[float]) -> Floats:
        """Return what `estimate` does for a tick; zeros with the brakes on."""
        if state.robot_mode != RUNNING:
            return np.zeros(6 + len(state.actual_q))
        return self.estimate(as_rows(joint_lists(state)), offset)

"""Wrench at the tool: from a flange sensor, or estimated from drive torques (see `RigidBody`)."""

from collections.abc import Sequence
from struct import pack

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.least_squares import solve_in_place
from tvist_controller.kinematics.pose import locate
from tvist_kernels.compiling import inlined
from tvist_plant.model import Floats
from tvist_plant.plant import GRAVITY
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State
from tvist_protocol.values import Payload

JOINT_LISTS = (
    "target_q", "target_qd", "target_qdd", "shaped_q", "shaped_qd", "shaped_qdd", "shaped_moment", "actual_q",
    "actual_qd", "actual_moment",
)  # fmt: skip
"""Rows, named as RTDE variables: unshaped reference, shaped reference with its torques, measured values."""
ROWS = len(JOINT_LISTS)
UNSHAPED, SHAPED = slice(0, 3), slice(3, 6)
"""Rows of positions, velocities and accelerations of the two references."""
SHAPED_QD, SHAPED_QDD, SHAPED_MOMENT, ACTUAL_Q, ACTUAL_QD, ACTUAL_MOMENT = range(4, ROWS)  # single rows


def unshaped(state: State) -> tuple[list[float], list[float], list[float]]:
    """Return q, q̇ and q̈ of the unshaped reference at the tick of the shaped reference in the same state."""
    if state.unshaped_q is None or state.unshaped_qd is None or state.unshaped_qdd is None:
        return state.target_q, state.target_qd, state.target_qdd
    return state.unshaped_q, state.unshaped_qd, state.unshaped_qdd


def joint_lists(state: State) -> bytearray:
    """Return ten joint quantities of a state, row by row, as doubles in native byte order."""
    shaped = state.target_q, state.target_qd, state.target_qdd, state.target_moment
    rows = *unshaped(state), *shaped, state.actual_q, state.actual_qd, state.actual_moment
    return bytearray(pack(f"{ROWS * len(state.target_q)}d", *[value for row in rows for value in row]))


NEAR_SINGULAR = 0.01
"""Manipulability √det(J Jᵀ) below which estimates are damped; at most 0.11 on a UR5e [m³ with six joints]."""
DAMPING = 0.08  # λ₀, the damping factor at a singularity [m, or -]
RUNNING = int(RobotMode.RUNNING)
"""Robot mode in which the drives hold the arm, as an int for quick comparison."""


def since_zeroed(wrench: list[float], zero: list[float] | None) -> list[float]:
    """Subtract the wrench that a program has set as zero, if any [N, N m]."""
    return wrench if zero is None else [felt - none for felt, none in zip(wrench, zero, strict=True)]


@compiled_for_ticks
def product(A: Floats, B: Floats) -> Floats:
    """Return the product of two small matrices."""
    found = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                found[i, j] += A[i, k] * B[k, j]
    return found


@inlined
def force_at(chain: Floats, q: Floats, torque: Floats, force: Floats) -> None:
    """Compute the wrench [N, N m] at a chain's end that causes joint torques; see `RigidBody.external`."""
    n = q.shape[0]
    J = np.empty((6, n))
    locate(chain, q, np.empty((3, 3)), np.empty(3), J)
    square = product(J.T, J) if n <= 6 else product(J, J.T)
    known = torque.copy() if n <= 6 else product(J, torque.reshape(n, 1))[:, 0].copy()
    found = known.copy()
    manipulability = solve_in_place(square.copy(), found)
    if manipulability < NEAR_SINGULAR:
        damping = DAMPING * (1.0 - manipulability / NEAR_SINGULAR)
        for k in range(square.shape[0]):
            square[k, k] += damping * damping
        found = known
        solve_in_place(square, found)
    for k in range(6):
        force[k] = found[k]
        if n <= 6:
            force[k] = 0.0
            for j in range(n):
                force[k] += J[k, j] * found[j]


@compiled_for_ticks
def estimate(
    chain: Floats,  # its end is the tool centre point, see `tvist_plant.chain`, shape (n+1, 22)
    motion: Floats,  # see `joint_lists`, shape (10, n)
    drives: Floats,  # inertia of the rotors [kg m²] and Coulomb friction [N m], shape (2, n)
    slip: Floats,  # share of the friction that acts, shape (n,) [-]
    out: Floats,  # force and torque at the point [N, N m], then torques on the joints [N m], shape (6 + n,)
) -> None:
    """Estimate external wrench and torques; see `RigidBody.external`."""
    for j in range(slip.shape[0]):
        expected = motion[SHAPED_MOMENT, j] + drives[0, j] * motion[SHAPED_QDD, j] + drives[1, j] * slip[j]
        out[6 + j] = expected - motion[ACTUAL_MOMENT, j]
    force_at(chain, motion[ACTUAL_Q], out[6:], out[:6])


def without_weight(raw: Floats, rotation: Floats, payload: Payload) -> Floats:
    """Subtract the payload's weight from a flange sensor's wrench, in its own frame, shape (6,) [N, N m].

    As on UR's e-Series, the payload's inertia is not subtracted. `rotation` leads from the flange to the base frame.
    """
    weight = -payload.mass * GRAVITY * rotation[2]
    return np.asarray(raw - np.concatenate((weight, np.cross(payload.com, weight))))


def sensed_at_tool(
    raw: Floats, rotation: Floats, payload: Payload, zero: list[float] | None, offset: Sequence[float]
) -> Floats:
    """Return a flange sensor's wrench at the TCP (`offset`), base frame, without weight and zero, (6,)."""
    felt = without_weight(raw, rotation, payload)
    force, torque = np.split(felt if zero is None else felt - zero, 2)
    return np.concatenate((rotation @ force, rotation @ (torque - np.cross(offset[:3], force))))

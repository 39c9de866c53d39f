"""By how much motors have to lead so that an elastic arm follows its target.

A gear that transmits a load τ without gravity twists by τ/K_g, and a link that carries one bends by φ = -τ_f/k_b. Both
lag by the damping time D/K, a fraction of a tick. The joints have to turn by the twist, and by what moves the flange
back by as much as the bending has moved it:

    w = τ/K_g + J_jᵀ (J_j J_jᵀ + λ² E)⁻¹ (-J_f φ)

J_j and J_f are the flange's translation Jacobians with respect to joints and bending. λ keeps w small near singular
postures, where joints would have to turn far to move the flange a little (Nakamura and Hanafusa, 1986).

While links bend and joints move the flange back, both accelerate masses of the arm, by φ̈ and J_j⁺ (-J_f φ̈). The load τ
contains these, too: without them the modes in which links bend, at 20 to 50 Hz, would be left to ring.
"""

import numpy as np
import numpy.typing as npt

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.least_squares import solve_in_place
from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import torques

Integers = npt.NDArray[np.int64]

DAMPED = 0.1
"""λ, in the order of the lever arms that may be taken for none [m]."""


@compiled_for_ticks
def move_back(jacobian: Floats, joints: Integers, moved: Floats, back: Floats) -> None:
    """Compute by what the joints have to turn to move the flange, J_jᵀ (J_j J_jᵀ + λ² E)⁻¹ times its way.

    Args:
        jacobian: Translation of the flange, shape (3, N) [m/rad].
        joints: Indices of the n joints, shape (n,).
        moved: The way, which is changed, shape (3,) [m].
        back: Result, shape (n,) [rad].
    """
    n = joints.shape[0]
    square = np.zeros((3, 3))
    for row in range(3):
        square[row, row] = DAMPED * DAMPED
        for column in range(3):
            for j in range(n):
                square[row, column] += jacobian[row, joints[j]] * jacobian[column, joints[j]]
    solve_in_place(square, moved)
    for j in range(n):
        back[j] = 0.0
        for row in range(3):
            back[j] += jacobian[row, joints[j]] * moved[row]


@compiled_for_ticks
def bending_accelerations(
    load: Floats,
    jacobian: Floats,
    joints: Integers,
    flexes: Integers,
    stiffness: Floats,
    bent: Floats,
    period: float,
    found: Floats,
) -> None:
    """Compute the accelerations of bending links, and of the joints that move the flange back meanwhile.

    They are second differences, and therefore those of the tick before; at 30 Hz this is a sixteenth of a period late.

    Args:
        load: Torques on the springs for links that do not accelerate, without gravity, shape (N,) [N m].
        jacobian: See `move_back`.
        joints: Indices of the n joints, shape (n,).
        flexes: Indices of the bending, at least one, shape (m,).
        stiffness: Stiffness of each spring, shape (N,) [N m/rad].
        bent: Bending at the last three ticks, the newest first; moved on by one, shape (3, m) [rad].
        period: Tick [s].
        found: Result, in the order of the model's coordinates, shape (N,) [rad/s^2].
    """
    moved, back = np.zeros(3), np.empty(joints.shape[0])
    for k in range(flexes.shape[0]):
        c = flexes[k]
        bent[2, k], bent[1, k], bent[0, k] = bent[1, k], bent[0, k], -load[c] / stiffness[c]
        found[c] = (bent[0, k] - 2.0 * bent[1, k] + bent[2, k]) / (period * period)
        for row in range(3):
            moved[row] -= jacobian[row, c] * found[c]
    move_back(jacobian, joints, moved, back)
    for j in range(joints.shape[0]):
        found[joints[j]] = back[j]


@compiled_for_ticks
def loads_of(
    chain: Floats,
    motion: Floats,
    scratch: Floats,
    jacobian: Floats,
    load: Floats,
) -> None:
    """Compute the torques on all springs without gravity, which is static: it makes the arm sag, not swing.

    Args:
        chain: Links of the arm with those that bend, see `tvist_plant.chain`, shape (N+1, 22).
        motion: Angles, velocities and accelerations of joints and bending, shape (3, N).
        scratch: Scratch of the chain, shape (N+1, 28).
        jacobian: Result: translation of the flange, shape (3, N) [m/rad].
        load: Result, shape (N,) [N m].
    """
    torques(chain, motion[0], motion[1], motion[2], 0.0, scratch, load)
    N = load.shape[0]
    x, y, z = scratch[N, 9], scratch[N, 10], scratch[N, 11]
    for c in range(N):
        S = scratch[c]
        jacobian[0, c] = S[3] + S[1] * z - S[2] * y
        jacobian[1, c] = S[4] + S[2] * x - S[0] * z
        jacobian[2, c] = S[5] + S[0] * y - S[1] * x


@compiled_for_ticks
def wanted_lead(
    load: Floats,
    jacobian: Floats,
    joints: Integers,
    flexes: Integers,
    stiffness: Floats,
    late: Floats,
    before: Floats,
    lead: Floats,
) -> None:
    """Compute w.

    Args:
        load: Torques on the springs without gravity, shape (N,) [N m].
        jacobian: Translation of the flange, shape (3, N) [m/rad].
        joints: Indices of the n joints, shape (n,).
        flexes: Indices of the bending, shape (m,).
        stiffness: Stiffness of each spring, shape (N,) [N m/rad].
        late: Damping time divided by the tick, shape (N,) [-].
        before: Deflections without damping of the tick before, replaced by the present ones, shape (N,) [rad].
        lead: Result, shape (n,) [rad].
    """
    n, m = joints.shape[0], flexes.shape[0]
    moved, back = np.zeros(3), np.zeros(n)
    for k in range(m):
        c = flexes[k]
        own = -load[c] / stiffness[c]
        bent = own + late[c] * (before[c] - own)
        before[c] = own
        for row in range(3):
            moved[row] -= jacobian[row, c] * bent
    if m > 0:
        move_back(jacobian, joints, moved, back)
    for j in range(n):
        c = joints[j]
        own = load[c] / stiffness[c]
        lead[j] = own + late[c] * (before[c] - own) + back[j]
        before[c] = own


@compiled_for_ticks
def lead_of(
    chain: Floats,
    q: Floats,
    qd: Floats,
    qdd: Floats,
    joints: Integers,
    flexes: Integers,
    stiffness: Floats,
    late: Floats,
    bent: Floats,
    before: Floats,
    first: bool,
    smooth: bool,
    period: float,
    motion: Floats,
    scratch: Floats,
    jacobian: Floats,
    loads: Floats,
    wanted: Floats,
    torque: Floats,
    rotor: Floats,
    with_torques: bool,
    needed: Floats,
) -> None:
    """Compute w for a target, and the torque that arm and rotors need for it.

    Args:
        chain: See `loads_of`.
        q: Target, shape (n,) [rad].
        qd: Its velocity [rad/s].
        qdd: Its acceleration [rad/s^2].
        joints: Indices of the n joints, shape (n,).
        flexes: Indices of the bending, shape (m,).
        stiffness: Stiffness of each spring, shape (N,) [N m/rad].
        late: Damping time divided by the tick, shape (N,) [-].
        bent: Bending at the last three ticks, the newest first; moved on by one, shape (3, m) [rad].
        before: Deflections without damping of the tick before, replaced by the present ones, shape (N,) [rad].
        first: Whether there was no tick before.
        smooth: Whether the reference is, so that second differences say how bending links accelerate.
        period: Tick [s].
        motion: Scratch, shape (3, N); zero for the bending, in the first two rows.
        scratch: Scratch of the chain, shape (N+1, 28).
        jacobian: Scratch, shape (3, N).
        loads: Result: torques on the springs if the bending did not accelerate, and as it does, shape (2, N) [N m].
        wanted: Leads of the last three ticks, the newest first; moved on by one, shape (3, n) [rad].
        torque: τ* of the rigid arm, shape (n,) [N m].
        rotor: Rotor inertia, shape (n,) [kg m^2].
        with_torques: Whether torques count with the lead.
        needed: Result, shape (n,) [N m].
    """
    m = flexes.shape[0]
    for j in range(joints.shape[0]):
        c = joints[j]
        motion[0, c], motion[1, c], motion[2, c] = q[j], qd[j], qdd[j]
    for k in range(m):
        motion[2, flexes[k]] = 0.0
    loads_of(chain, motion, scratch, jacobian, loads[0])
    if first:
        for c in range(before.shape[0]):
            before[c] = loads[0, c] / stiffness[c]
        for k in range(m):
            before[flexes[k]] *= -1.0
            bent[:, k] = before[flexes[k]]
    loads[1] = loads[0]
    if m > 0:
        more = np.empty(loads.shape[1])
        bending_accelerations(loads[0], jacobian, joints, flexes, stiffness, bent, period, more)
        if smooth:
            motion[2] += more
            torques(chain, motion[0], motion[1], motion[2], 0.0, scratch, loads[1])
    wanted[2], wanted[1] = wanted[1], wanted[0]
    wanted_lead(loads[1], jacobian, joints, flexes, stiffness, late, before, wanted[0])
    for j in range(joints.shape[0]):
        needed[j] = torque[j] + rotor[j] * qdd[j]
        if with_torques:
            needed[j] += loads[1, joints[j]] - loads[0, joints[j]]

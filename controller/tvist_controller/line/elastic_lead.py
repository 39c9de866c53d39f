"""Kernels: the lead of the motors that keeps an elastic arm's flange on target, and the resulting commands.

A gear with load τ (without gravity) twists by τ/K_g, and a bending link by φ = -τ_f/k_b. Both lag by the damping time
D/K, a fraction of a tick. The joints must turn by the twist, and by what returns the flange to its place:

    w = τ/K_g + J_jᵀ (J_j J_jᵀ + λ² E)⁻¹ (-J_f φ)

J_j and J_f are the flange's translation Jacobians of joints and bending. λ keeps w small near singular postures, where
small flange motions need large joint turns (Nakamura and Hanafusa, 1986).

The bending links accelerate by φ̈, and the joints that compensate them by J_j⁺ (-J_f φ̈). The load τ includes both;
otherwise the bending modes, at 20 to 50 Hz, would stay excited.
"""

from typing import NamedTuple

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.least_squares import put, solve_in_place
from tvist_controller.line.joint_controllers import LAWS, friction_at, sticks, stiction_at
from tvist_kernels.compiling import inlined
from tvist_plant.chain import SCRATCH, WIDTH, torques
from tvist_plant.model import Floats

DAMPED = 0.1  # λ, of the order of lever arms that may be neglected [m]
RECOVERY = 120.0  # rate of the lead's return after its acceleration was limited, critically damped [1/s]
ROTOR, FRICTION, MOST, LEAST, STICTION, LAW = range(6)
"""Rows of a drive's parameters: rotor inertia [kg m^2]; fed-forward Coulomb friction [N m], or its slope if
linear [N m s/rad]; torque that motion and lead may use together, and that the lead may always use [N m];
stiction of the last command [N m]; first row of the known friction, see `LAWS`."""
COORDINATES, JOINTS, FLEXES, PERIOD, FRICTION_WIDTH, LINEAR, WITH_TORQUES, WITH_LAW, HEAD = range(9)
"""Indices of the scalars at the front of the memory, and their number. The last three are 1 or 0: linear
friction; torques include the lead; friction is known and replaces the description's."""


class Lead(NamedTuple):
    """Views of the memory of an arm with N coordinates, n joints and m bending joints."""

    joints: Floats  # indices of the joints among the coordinates, shape (n,)
    flexes: Floats  # indices of the bending joints, shape (m,)
    chain: Floats  # links of the arm, including bending ones, see `tvist_plant.chain`, shape (N+1, 22)
    bodies: Floats  # scratch of the chain, shape (N+1, 28)
    springs: Floats  # stiffness of each spring [N m/rad], and damping time in ticks [-], shape (2, N)
    drives: Floats  # rows of `ROTOR` etc., shape (14, n)
    late: Floats  # previous target and its torque, shape (4, n)
    leads: Floats  # wanted and actual leads of the last three ticks, newest first, shape (2, 3, n) [rad]
    before: Floats  # undamped deflections at the previous tick, shape (N,) [rad]
    motion: Floats
    """Angles, velocities and accelerations of the coordinates; the first two are zero for bending, shape (3, N)."""
    jacobian: Floats  # translation Jacobian of the flange, shape (3, N) [m/rad]
    loads: Floats  # spring torques without gravity, without and with bending acceleration, shape (2, N) [N m]
    bent: Floats  # bending at the last three ticks, newest first, shape (3, m) [rad]


def memory_for(N: int, n: int, m: int) -> Floats:
    """Return zeroed memory for an arm with N coordinates, n joints and m bending joints."""
    memory = np.zeros(HEAD + (N + 1) * (WIDTH + SCRATCH) + 11 * N + (LAW + LAWS + 11) * n + 4 * m)
    memory[COORDINATES], memory[JOINTS], memory[FLEXES] = N, n, m
    return memory


@compiled_for_ticks
def parts(memory: Floats) -> Lead:
    """Return the parts of a memory by name, as views."""
    N, n, m = int(memory[COORDINATES]), int(memory[JOINTS]), int(memory[FLEXES])
    a = HEAD + n + m
    b = a + (N + 1) * WIDTH
    c = b + (N + 1) * SCRATCH
    d = c + 2 * N
    e = d + (LAW + LAWS) * n
    f = e + 4 * n
    g = f + 6 * n
    h = g + 4 * N
    i = h + 3 * N
    j = i + 2 * N
    return Lead(
        memory[HEAD : HEAD + n],
        memory[HEAD + n : a],
        memory[a:b].reshape(N + 1, WIDTH),
        memory[b:c].reshape(N + 1, SCRATCH),
        memory[c:d].reshape(2, N),
        memory[d:e].reshape(LAW + LAWS, n),
        memory[e:f].reshape(4, n),
        memory[f:g].reshape(2, 3, n),
        memory[g : g + N],
        memory[g + N : h].reshape(3, N),
        memory[h:i].reshape(3, N),
        memory[i:j].reshape(2, N),
        memory[j:].reshape(3, m),
    )


@compiled_for_ticks
def move_back(lead: Lead, moved: Floats, back: Floats) -> None:
    """Compute joint turns moving the flange by `moved`: J_jᵀ (J_j J_jᵀ + λ² E)⁻¹ moved; overwrite `moved`."""
    n = lead.joints.shape[0]
    square = np.zeros((3, 3))
    for row in range(3):
        square[row, row] = DAMPED * DAMPED
        for column in range(3):
            for j in range(n):
                c = int(lead.joints[j])
                square[row, column] += lead.jacobian[row, c] * lead.jacobian[column, c]
    solve_in_place(square, moved)
    for j in range(n):
        back[j] = 0.0
        for row in range(3):
            back[j] += lead.jacobian[row, int(lead.joints[j])] * moved[row]


@inlined
def bending_accelerations(lead: Lead, period: float, found: Floats) -> None:
    """Compute accelerations of bending and compensating joints, as second differences one tick late, (N,)."""
    bent, moved, back = lead.bent, np.zeros(3), np.empty(lead.joints.shape[0])
    for k in range(lead.flexes.shape[0]):
        c = int(lead.flexes[k])
        bent[2, k], bent[1, k], bent[0, k] = bent[1, k], bent[0, k], -lead.loads[0, c] / lead.springs[0, c]
        found[c] = (bent[0, k] - 2.0 * bent[1, k] + bent[2, k]) / (period * period)
        for row in range(3):
            moved[row] -= lead.jacobian[row, c] * found[c]
    move_back(lead, moved, back)
    for j in range(lead.joints.shape[0]):
        found[int(lead.joints[j])] = back[j]


@inlined
def loads_of(lead: Lead) -> None:
    """Compute the spring torques without gravity and bending acceleration, and the Jacobian."""
    motion, bodies, jacobian, load = lead.motion, lead.bodies, lead.jacobian, lead.loads[0]
    torques(lead.chain, motion[0], motion[1], motion[2], 0.0, bodies, load)
    N = load.shape[0]
    x, y, z = bodies[N, 9], bodies[N, 10], bodies[N, 11]
    for c in range(N):
        S = bodies[c]
        jacobian[0, c] = S[3] + S[1] * z - S[2] * y
        jacobian[1, c] = S[4] + S[2] * x - S[0] * z
        jacobian[2, c] = S[5] + S[0] * y - S[1] * x


@inlined
def wanted_lead(lead: Lead, load: Floats, found: Floats) -> None:
    """Compute w (n,) [rad] from spring torques (N,) [N m]."""
    n, m = lead.joints.shape[0], lead.flexes.shape[0]
    stiffness, late, before = lead.springs[0], lead.springs[1], lead.before
    moved, back = np.zeros(3), np.zeros(n)
    for k in range(m):
        c = int(lead.flexes[k])
        own = -load[c] / stiffness[c]
        bent = own + late[c] * (before[c] - own)
        before[c] = own
        for row in range(3):
            moved[row] -= lead.jacobian[row, c] * bent
    if m > 0:
        move_back(lead, moved, back)
    for j in range(n):
        c = int(lead.joints[j])
        own = load[c] / stiffness[c]
        found[j] = own + late[c] * (before[c] - own) + back[j]
        before[c] = own


@inlined
def lead_of(  # noqa: C901  a kernel: its branches are loops
    lead: Lead,  # its wanted leads are moved on by one
    target: Floats,  # q, q̇ and q̈, and τ* of the rigid arm, shape (4, n)
    first: bool,  # whether there was no tick before
    smooth: bool,  # whether second differences give the accelerations of bending links
    memory: Floats,
    needed: Floats,  # result, shape (n,) [N m]
) -> None:
    """Compute w for a target and the torque that arm and rotors need."""
    n, m, motion, loads, wanted = (
        target.shape[1],
        lead.flexes.shape[0],
        lead.motion,
        lead.loads,
        lead.leads[0],
    )
    for j in range(n):
        c = int(lead.joints[j])
        motion[0, c], motion[1, c], motion[2, c] = target[0, j], target[1, j], target[2, j]
    for k in range(m):
        motion[2, int(lead.flexes[k])] = 0.0
    loads_of(lead)
    if first:
        for c in range(lead.before.shape[0]):
            lead.before[c] = loads[0, c] / lead.springs[0, c]
        for k in range(m):
            lead.before[int(lead.flexes[k])] *= -1.0
            for row in range(lead.bent.shape[0]):
                lead.bent[row, k] = lead.before[int(lead.flexes[k])]
    put(loads[0], loads[1])
    if m > 0:
        more = np.empty(loads.shape[1])
        bending_accelerations(lead, memory[PERIOD], more)
        if smooth:
            for c in range(len(more)):
                motion[2, c] += more[c]
            torques(lead.chain, motion[0], motion[1], motion[2], 0.0, lead.bodies, loads[1])
    put(wanted[1], wanted[2])
    put(wanted[0], wanted[1])
    wanted_lead(lead, loads[1], wanted[0])
    for j in range(n):
        needed[j] = target[3, j] + lead.drives[ROTOR, j] * target[2, j]
        if memory[WITH_TORQUES] > 0.0:
            needed[j] += loads[1, int(lead.joints[j])] - loads[0, int(lead.joints[j])]


@compiled_for_ticks
def follow(
    wanted: Floats,  # at this tick and the two before, the newest first, shape (3, n) [rad]
    led: Floats,  # leads of the last three ticks likewise, which are moved on by one
    room: Floats,  # largest acceleration of each joint's lead, shape (n,) [rad/s^2]
    period: float,
) -> bool:
    """Advance the actual lead; once limited, it returns critically damped. Return whether limited now."""
    limited = False
    for j in range(led.shape[1]):
        now, before = led[0, j], led[1, j]
        away = now - wanted[1, j]
        drift = (away - before + wanted[2, j]) / period
        acceleration = (wanted[0, j] - 2.0 * wanted[1, j] + wanted[2, j]) / (period * period)
        acceleration -= RECOVERY * (RECOVERY * away + 2.0 * drift)
        if abs(acceleration) > room[j]:
            limited = True
            acceleration = room[j] if acceleration > 0.0 else -room[j]
        led[2, j], led[1, j] = before, now
        led[0, j] = 2.0 * now - before + period * period * acceleration
    return limited


@compiled_for_ticks
def command_motors(  # noqa: C901, PLR0912  a kernel: its branches are loops
    memory: Floats,  # see `parts`
    target: Floats,  # see `lead_of`
    ticks: int,  # number of targets before this one; the first three leads are as wanted
    smooth: bool,
    motors: Floats,  # result: positions, velocities, accelerations and torques of the motors, shape (4, n)
) -> bool:
    """Compute a target's lead and the previous target's commands; return whether the lead was limited."""
    lead, period, with_torques = parts(memory), memory[PERIOD], memory[WITH_TORQUES] > 0.0
    n, late, drives, wanted, led = target.shape[1], lead.late, lead.drives, lead.leads[0], lead.leads[1]
    needed, limited = np.empty(n), False
    lead_of(lead, target, ticks == 0, smooth, memory, needed)
    if ticks == 0:
        for row in range(3):
            put(target[row], late[row])
        put(needed, late[3])
    if ticks < 3:
        for row in range(ticks + 1, 3):
            put(wanted[0], wanted[row])
        for row in range(3):
            put(wanted[row], led[row])
    else:
        room = np.empty(n)
        for j in range(n):
            room[j] = max(drives[MOST, j] - abs(late[3, j]), drives[LEAST, j]) / drives[ROTOR, j]
        limited = follow(wanted, led, room, period)
    for j in range(n):
        rise = (led[0, j] - 2.0 * led[1, j] + led[2, j]) / (period * period)
        motors[0, j] = late[0, j] + led[1, j]
        motors[1, j] = late[1, j] + (led[0, j] - led[2, j]) / (2.0 * period)
        motors[2, j] = late[2, j] + rise
        speed = motors[1, j] if with_torques else late[1, j]
        if memory[WITH_LAW] > 0.0:
            law, load = drives[LAW:], late[3, j] - drives[ROTOR, j] * late[2, j]
            if sticks(law, j):
                drives[STICTION, j] = stiction_at(law, j, drives[STICTION, j], period, speed, load)
            motors[3, j] = late[3, j] + friction_at(law, j, speed) + drives[STICTION, j]
        else:
            share = speed if memory[LINEAR] > 0.0 else np.tanh(speed / memory[FRICTION_WIDTH])
            motors[3, j] = late[3, j] + drives[FRICTION, j] * share
        if with_torques:
            motors[3, j] += drives[ROTOR, j] * rise
    for row in range(3):
        put(target[row], late[row])
    put(needed, late[3])
    return limited

"""One control period of arm and drives: the linearly implicit midpoint rule.

During a period M(q) keeps its midpoint value and the bias b(q, q̇) changes linearly; both are extrapolated from the
last two ticks. Springs, dampers and drive gains are implicit, so one Cholesky factor serves all substeps of the period:

    S = M_b + h/2 D + h²/4 (K + h/2 G_i)

with the substep h, M_b = diag(M(q), B) and the integral gains G_i. Each substep solves for the mean acceleration and
moves y by the mean velocity. The method is of second order, and stable for the fast poles of light lumps between stiff
springs (about -5e4 1/s), for which explicit methods need steps below 0.04 ms.

Each motor is coupled to its joint's link only. The motors are therefore eliminated first, and only the links' matrix

    S_ll - Σ_j c_j² / S_mm,j at the joint's link,    c_j = -(h/2 D_g + h²/4 K_g)

is factorised.
"""

import math

from tvist_kernels.compiling import compiled
from tvist_plant.arm_memory import LAST, NOW, PERIOD, SUBSTEPS, ArmMemory, of_joint
from tvist_plant.drives import JointParameters
from tvist_plant.model import Floats
from tvist_plant.stiction import relaxed, stiction_after


@compiled
def cholesky(S: Floats) -> None:
    """Replace the lower triangle of a positive definite matrix by its Cholesky factor, diagonal inverted."""
    for j in range(S.shape[0]):
        pivot = S[j, j]
        for k in range(j):
            pivot -= S[j, k] * S[j, k]
        pivot = 1.0 / math.sqrt(pivot)
        S[j, j] = pivot
        for i in range(j + 1, S.shape[0]):
            value = S[i, j]
            for k in range(j):
                value -= S[i, k] * S[j, k]
            S[i, j] = value * pivot


@compiled
def solve(L: Floats, x: Floats) -> None:
    """Replace x, as far as L reaches, by (L Lᵀ)⁻¹ x, with L from `cholesky`."""
    n = L.shape[0]
    for i in range(n):
        value = x[i]
        for k in range(i):
            value -= L[i, k] * x[k]
        x[i] = value * L[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i] * L[i, i]
        x[i] = value
        for k in range(i):
            x[k] -= L[i, k] * value


@compiled
def rows(state: Floats, n: int) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
    """Return views of the rows of the state of an arm with N links and n motors, shape (6, N+n).

    - y: angles of N links, then n motors, shape (N+n,) [rad]
    - v: velocities, shape (N+n,) [rad/s]
    - a: mean accelerations of the last substep, shape (N+n,) [rad/s^2]
    - s: integrators of the drives, shape (n,) [rad s]
    - z: hysteresis torque of each gear, shape (n,) [N m]
    - d: stiction of each motor, shape (n,) [N m]
    - load: torque in each motor's gear in the middle of the last substep, if motors stick, shape (n,) [N m]
    """
    last = state[5]
    return state[0], state[1], state[2], state[3, :n], state[4, :n], last[:n], last[n : 2 * n]


@compiled
def shift(ticks: Floats) -> None:
    """Copy NOW to LAST in loops; numba takes seconds to compile an assignment of arrays."""
    for i in range(ticks.shape[1]):
        for j in range(ticks.shape[2]):
            ticks[LAST, i, j] = ticks[NOW, i, j]


@compiled
def set_points(commands: Floats, j: int, share: float) -> tuple[float, float, float]:
    """Return q_r, q̇_r and τ_ff of joint j at a fraction of the period."""
    start, end = commands[LAST], commands[NOW]
    return (
        start[0, j] + share * (end[0, j] - start[0, j]),
        start[1, j] + share * (end[1, j] - start[1, j]),
        start[2, j] + share * (end[2, j] - start[2, j]),
    )


@compiled
def softened(joint: JointParameters[float], twist: float) -> float:
    """Return the part of a gear's torque beyond K δ, which backlash and softness near zero cause [N m]."""
    loose = min(max(twist, -joint.backlash), joint.backlash)
    soft = joint.softness * min(max(twist - loose, -joint.soft_angle), joint.soft_angle)
    return float(-joint.gear_stiffness * loose - soft)


@compiled
def dragged(joint: JointParameters[float], z: float, twist: float) -> float:
    """Return the hysteresis torque of a joint's gear, z before a further twist, after this twist [N m]."""
    if joint.hysteresis > 0.0:
        return relaxed(z, twist, joint.hysteresis, joint.hysteresis_torque)
    return z


@compiled
def stuck(joint: JointParameters[float], d: float, way: float, speed: float, load: float) -> float:
    """Return the stiction torque of a joint's motor, d before a turn by `way`, after this turn [N m]."""
    law = joint.stiction, joint.stiction_load, joint.stiction_speed, joint.stiction_stiffness
    return stiction_after(d, way, speed, load, *law)


@compiled
def coupling(joint: JointParameters[float], h: float) -> float:
    """Return entry c_j of S, between a motor and its joint's link."""
    return float(-0.5 * h * joint.gear_damping - 0.25 * h * h * joint.gear_stiffness)


@compiled
def of_motor(joint: JointParameters[float], springs: Floats, m: int, h: float) -> float:
    """Return the diagonal entry of S at the motor with index m."""
    implicit = 0.5 * h * springs[1, m] + 0.25 * h * h * springs[0, m]
    return float(joint.rotor_inertia + implicit + 0.125 * h * h * h * joint.integral_gain)


@compiled
def factorise(arm: ArmMemory, h: float) -> None:
    """Compute the Cholesky factor for all substeps of a period, of h [s] each."""
    S, springs, n, links = arm.factor, arm.springs, arm.joints.shape[1], arm.qdd.shape[0]
    M, last_M = arm.dynamics[NOW], arm.dynamics[LAST]
    for i in range(links):
        for j in range(i + 1):
            S[i, j] = 1.5 * M[j, i] - 0.5 * last_M[j, i]
        S[i, i] += 0.5 * h * springs[1, i] + 0.25 * h * h * springs[0, i]
    for j in range(n):
        joint = of_joint(arm.joints, j)
        l, c = int(joint.link), coupling(joint, h)
        S[l, l] -= c * c / of_motor(joint, springs, links + j, h)
    cholesky(S)


@compiled
def advance(arm: ArmMemory, head: Floats) -> None:  # noqa: C901, PLR0912, PLR0915 - one kernel: its branches are the loops over rows and joints
    """Advance the state by one period in place, then shift commands and dynamics from NOW to LAST."""
    n, links = arm.joints.shape[1], arm.qdd.shape[0]
    size, period, substeps = links + n, head[PERIOD], int(head[SUBSTEPS])
    y, v, a, s, z, d, load = rows(arm.state, n)
    bias, last_bias = arm.dynamics[NOW, links], arm.dynamics[LAST, links]
    springs, f = arm.springs, arm.force
    h = period / substeps
    sticks = False  # whether any motor has stiction; without it, the loops below are faster
    for j in range(n):
        joint = of_joint(arm.joints, j)
        sticks = sticks or joint.stiction > 0.0 or joint.stiction_load > 0.0
    factorise(arm, h)
    for step in range(substeps):
        middle = (step + 0.5) / substeps
        for i in range(links):
            f[i] = -bias[i] - middle * (bias[i] - last_bias[i])
        for j in range(n):
            joint, m = of_joint(arm.joints, j), links + j
            l = int(joint.link)
            q_r, qd_r, torque = set_points(arm.commands, j, middle)
            speed = v[m] + 0.5 * h * a[m]
            angle = y[m] + 0.5 * h * speed
            rise = 1.0
            if joint.breakaway != 1.0:
                fall = math.exp(-((speed / joint.stribeck_speed) ** 2))
                rise = 1.0 + (joint.breakaway - 1.0) * fall
            # `springs` treats friction's slope at rest implicitly; correct the saturated part here.
            slack = 0.0
            if joint.friction > 0.0:
                steep = speed / joint.friction_width
                slack = joint.friction * (steep - rise * math.tanh(steep))
            swing = 0.0
            if joint.gear_error > 0.0:
                swing = math.sin(joint.gear_waves * angle + joint.gear_phase)
            wave = joint.gear_stiffness * joint.gear_error * swing
            more = 0.0
            if joint.softness != 0.0 or joint.hysteresis > 0.0 or joint.backlash > 0.0:
                twisting = v[l] + 0.5 * h * a[l] - speed
                twist = y[l] - y[m] + 0.5 * h * twisting - joint.gear_error * swing
                more = softened(joint, twist) + dragged(joint, z[j], 0.5 * h * twisting)
            f[m] = torque + joint.velocity_gain * qd_r + joint.position_gain * q_r + slack - wave
            f[m] += joint.integral_gain * (s[j] + 0.5 * h * q_r) + more
            f[l] += wave - more
            if sticks:
                turning = v[l] + 0.5 * h * a[l] - speed
                spring = joint.gear_stiffness * (y[l] - y[m] + 0.5 * h * turning)
                load[j] = spring + joint.gear_damping * turning - wave + more
                f[m] -= stuck(joint, d[j], 0.5 * h * speed, speed, load[j])
        for i in range(size):
            a[i] = f[i] - springs[1, i] * v[i] - springs[0, i] * (y[i] + 0.5 * h * v[i])
        for j in range(n):
            joint, m = of_joint(arm.joints, j), links + j
            l = int(joint.link)
            middle_y, middle_l = y[m] + 0.5 * h * v[m], y[l] + 0.5 * h * v[l]
            a[l] += joint.gear_damping * v[m] + joint.gear_stiffness * middle_y
            a[m] += joint.gear_damping * v[l] + joint.gear_stiffness * middle_l
            a[m] -= 0.5 * h * joint.integral_gain * middle_y
            a[l] -= coupling(joint, h) / of_motor(joint, springs, m, h) * a[m]
        solve(arm.factor, a)
        for j in range(n):
            joint, m = of_joint(arm.joints, j), links + j
            l = int(joint.link)
            a[m] = (a[m] - coupling(joint, h) * a[l]) / of_motor(joint, springs, m, h)
            q_r, _, _ = set_points(arm.commands, j, middle)
            s[j] += h * (q_r - (y[m] + 0.5 * h * (v[m] + 0.5 * h * a[m])))
            if sticks:
                speed = v[m] + 0.5 * h * a[m]
                d[j] = stuck(joint, d[j], h * speed, speed, load[j])
            if joint.hysteresis > 0.0:
                z[j] = dragged(joint, z[j], h * (v[l] - v[m] + 0.5 * h * (a[l] - a[m])))
        for i in range(size):
            y[i] += h * (v[i] + 0.5 * h * a[i])
            v[i] += h * a[i]
    shift(arm.commands)
    shift(arm.dynamics)


@compiled
def balance(arm: ArmMemory, moment: Floats) -> None:
    """Compute link accelerations `arm.qdd` and motor torques (`moment`, (n,) [N m]) in the present state."""
    n, links, qdd = arm.joints.shape[1], arm.qdd.shape[0], arm.qdd
    y, v, s, z = arm.state[0], arm.state[1], arm.state[3], arm.state[4]
    command, M, springs, S = arm.commands[NOW], arm.dynamics[NOW], arm.springs, arm.factor
    for i in range(links):
        qdd[i] = -M[links, i] - springs[0, i] * y[i] - springs[1, i] * v[i]
        for j in range(i + 1):
            S[i, j] = M[j, i]
    for j in range(n):
        joint, m = of_joint(arm.joints, j), links + j
        l, swing = int(joint.link), 0.0
        if joint.gear_error > 0.0:
            swing = math.sin(joint.gear_waves * y[m] + joint.gear_phase)
        qdd[l] += joint.gear_damping * v[m] + joint.gear_stiffness * (y[m] + joint.gear_error * swing)
        qdd[l] -= z[j] + softened(joint, y[l] - y[m] - joint.gear_error * swing)
        moment[j] = command[2, j] + joint.velocity_gain * (command[1, j] - v[m])
        moment[j] += joint.position_gain * (command[0, j] - y[m]) + joint.integral_gain * s[j]
    cholesky(S)
    solve(S, qdd)

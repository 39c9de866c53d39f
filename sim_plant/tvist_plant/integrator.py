"""One control period of arm and drives: the linearly implicit midpoint rule.

M(q) is constant during the period at its value in the middle, and the bias b(q, q̇) changes linearly; both are
extrapolated from the last two ticks. Springs, dampers and the drives' gains are implicit, so a single Cholesky factor
of

    S = M_b + h/2 D + h²/4 (K + h/2 G_i)

is used for all substeps of the period (h one substep, M_b = diag(M(q), B), G_i the integral gains). Each substep
solves for the mean acceleration, and moves y by the mean velocity. The method is of second order, and stable for the
fast poles of light lumps between stiff springs (about -5e4 1/s), for which explicit methods need steps below 0.04 ms.
"""

import math
from typing import NamedTuple

import numpy as np

from tvist_plant._compiled import compiled
from tvist_plant.joint_parameters import JointParameters, of_joint
from tvist_plant.model import Floats, Integers

LAST, NOW = 0, 1
"""Indices of the commands and dynamics of the last and the current tick."""


@compiled
def cholesky(S: Floats) -> None:
    """Replace the lower triangle of a positive definite matrix by its Cholesky factor; the rest is not changed."""
    for j in range(S.shape[0]):
        pivot = S[j, j]
        for k in range(j):
            pivot -= S[j, k] * S[j, k]
        pivot = np.sqrt(pivot)
        S[j, j] = pivot
        for i in range(j + 1, S.shape[0]):
            value = S[i, j]
            for k in range(j):
                value -= S[i, k] * S[j, k]
            S[i, j] = value / pivot


@compiled
def solve(L: Floats, x: Floats) -> None:
    """Replace x by (L Lᵀ)⁻¹ x."""
    n = L.shape[0]
    for i in range(n):
        value = x[i]
        for k in range(i):
            value -= L[i, k] * x[k]
        x[i] = value / L[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, n):
            value -= L[k, i] * x[k]
        x[i] = value / L[i, i]


class ArmState(NamedTuple):
    """State of the arm with N links and n motors."""

    y: Floats
    """Angles, N of the links then n of the motors, shape (N+n,) [rad]."""
    v: Floats
    """Their velocities, shape (N+n,) [rad/s]."""
    a: Floats
    """Mean accelerations of the last substep, shape (N+n,) [rad/s^2]."""
    s: Floats
    """Integrators of the drives, shape (n,) [rad s]."""
    z: Floats
    """Torque of each gear's hysteresis, shape (n,) [N m]."""


@compiled
def parts(state: Floats, n: int) -> ArmState:
    """Return the rows of a state, shape (5, N+n), by name, as views."""
    return ArmState(state[0], state[1], state[2], state[3, :n], state[4, :n])


@compiled
def shift(ticks: Floats) -> None:
    """Copy NOW to LAST in loops, since numba takes seconds to compile an assignment of arrays."""
    for i in range(ticks.shape[1]):
        for j in range(ticks.shape[2]):
            ticks[LAST, i, j] = ticks[NOW, i, j]


@compiled
def set_points(commands: Floats, j: int, share: float) -> tuple[float, float, float]:
    """Set-points q_r, q̇_r and τ_ff of joint j at a share of the period."""
    start, end = commands[LAST], commands[NOW]
    return (
        start[0, j] + share * (end[0, j] - start[0, j]),
        start[1, j] + share * (end[1, j] - start[1, j]),
        start[2, j] + share * (end[2, j] - start[2, j]),
    )


@compiled
def relaxed(z: float, twist: float, stiffness: float, most: float) -> float:
    """Dahl's friction force z after a further twist in one direction: the exact solution of its equation."""
    end = most if twist > 0.0 else -most
    return float(end + (z - end) * math.exp(-stiffness * abs(twist) / most))


@compiled
def softened(joint: JointParameters, twist: float) -> float:
    """Difference of a gear's torque from K δ, because it is softer near zero [N m]."""
    return float(-joint.softness * min(max(twist, -joint.soft_angle), joint.soft_angle))


@compiled
def dragged(joint: JointParameters, z: float, twist: float) -> float:
    """Torque of the hysteresis in the gear of a joint after a further twist [N m]."""
    if joint.hysteresis > 0.0:
        return relaxed(z, twist, joint.hysteresis, joint.hysteresis_torque)
    return z


@compiled
def factor(S: Floats, dynamics: Floats, springs: Floats, parameters: Floats, h: float) -> None:
    """Compute in S the Cholesky factor for all substeps of a period, of h [s] each."""
    stiffness, damping = springs[0], springs[1]
    size, n, links = S.shape[0], parameters.shape[1], dynamics.shape[2]
    M, last_M = dynamics[NOW], dynamics[LAST]
    for i in range(size):
        for j in range(i + 1):
            S[i, j] = 0.5 * h * damping[i, j] + 0.25 * h * h * stiffness[i, j]
    for i in range(links):
        for j in range(i + 1):
            S[i, j] += 1.5 * M[j, i] - 0.5 * last_M[j, i]
    for j in range(n):
        joint = of_joint(parameters, j)
        S[links + j, links + j] += joint.rotor_inertia + 0.125 * h * h * h * joint.integral_gain
    cholesky(S)


@compiled
def advance(  # noqa: C901 - one kernel: its branches are the loops over rows and joints
    state: Floats,
    commands: Floats,
    dynamics: Floats,
    springs: Floats,
    parameters: Floats,
    joints: Integers,
    period: float,
    substeps: int,
) -> None:
    """Advance the state in place by one period; afterwards the LAST entries contain those of the present tick.

    Args:
        state: Rows of `ArmState`, shape (5, N+n).
        commands: Rows q_r, q̇_r, τ_ff of the last command and of this one, shape (2, 3, n); LAST becomes this one.
        dynamics: Mass matrix, upper triangle [kg m^2], and below it a row with the bias [N m]: Coriolis, centrifugal
            and gravity torques minus external ones; one period earlier and at the start, shape (2, N+1, N); LAST
            becomes that of the start.
        springs: Stiffness and damping of `LinearPart`, shape (2, N+n, N+n).
        parameters: Rows of `JointParameters`, shape (16, n).
        joints: Indices of the n joints among the N link angles.
        period: Control period [s].
        substeps: Number of substeps.
    """
    n, size, links = parameters.shape[1], state.shape[1], dynamics.shape[2]
    y, v, a, s, z = parts(state, n)
    bias, last_bias = dynamics[NOW, links], dynamics[LAST, links]
    stiffness, damping = springs[0], springs[1]
    h = period / substeps
    S, f = np.empty((size, size)), np.empty(size)
    factor(S, dynamics, springs, parameters, h)

    for step in range(substeps):
        middle = (step + 0.5) / substeps
        for i in range(links):
            f[i] = -bias[i] - middle * (bias[i] - last_bias[i])
        for j in range(n):
            joint, m, l = of_joint(parameters, j), links + j, joints[j]
            q_r, qd_r, torque = set_points(commands, j, middle)
            speed = v[m] + 0.5 * h * a[m]
            angle = y[m] + 0.5 * h * speed
            rise = 1.0
            if joint.breakaway != 1.0:
                fall = np.exp(-((speed / joint.stribeck_speed) ** 2))
                rise = 1.0 + (joint.breakaway - 1.0) * fall
            # Friction's slope at rest is implicit in `damping`; the part that saturates is corrected here.
            steep = speed / joint.friction_width
            slack = joint.friction * (steep - rise * np.tanh(steep))
            swing = np.sin(joint.gear_waves * angle + joint.gear_phase)
            wave = joint.gear_stiffness * joint.gear_error * swing
            more = 0.0
            if joint.softness != 0.0 or joint.hysteresis > 0.0:
                twisting = v[l] + 0.5 * h * a[l] - speed
                twist = y[l] - y[m] + 0.5 * h * twisting - joint.gear_error * swing
                more = softened(joint, twist) + dragged(joint, z[j], 0.5 * h * twisting)
            f[m] = torque + joint.velocity_gain * qd_r + joint.position_gain * q_r + slack - wave
            f[m] += joint.integral_gain * (s[j] + 0.5 * h * q_r) + more
            f[l] += wave - more
        for i in range(size):
            value = f[i]
            for j in range(size):
                value -= damping[i, j] * v[j] + stiffness[i, j] * (y[j] + 0.5 * h * v[j])
            a[i] = value
        for j in range(n):
            joint, m = of_joint(parameters, j), links + j
            a[m] -= 0.5 * h * joint.integral_gain * (y[m] + 0.5 * h * v[m])
        solve(S, a)
        for j in range(n):
            joint, m, l = of_joint(parameters, j), links + j, joints[j]
            q_r, _, _ = set_points(commands, j, middle)
            s[j] += h * (q_r - (y[m] + 0.5 * h * (v[m] + 0.5 * h * a[m])))
            twisted = h * (v[l] - v[m] + 0.5 * h * (a[l] - a[m]))
            z[j] = dragged(joint, z[j], twisted)
        for i in range(size):
            y[i] += h * (v[i] + 0.5 * h * a[i])
            v[i] += h * a[i]
    shift(commands)
    shift(dynamics)


@compiled
def balance(
    state: Floats,
    commands: Floats,
    dynamics: Floats,
    springs: Floats,
    parameters: Floats,
    joints: Integers,
    qdd: Floats,
    moment: Floats,
) -> None:
    """Link accelerations `qdd`, shape (N,) [rad/s^2], and motor torques `moment`, shape (n,) [N m], at a state.

    The other arguments are as in `advance`; only the present commands and dynamics are used.
    """
    n, size, links = parameters.shape[1], state.shape[1], dynamics.shape[2]
    y, v, _, s, z = parts(state, n)
    command, M = commands[NOW], dynamics[NOW]
    stiffness, damping = springs[0], springs[1]
    S = np.empty((links, links))
    for i in range(links):
        value = -M[links, i]
        for j in range(size):
            value -= stiffness[i, j] * y[j] + damping[i, j] * v[j]
        qdd[i] = value
        for j in range(i + 1):
            S[i, j] = M[j, i]
    for j in range(n):
        joint, m, l = of_joint(parameters, j), links + j, joints[j]
        swing = np.sin(joint.gear_waves * y[m] + joint.gear_phase)
        qdd[l] += joint.gear_stiffness * joint.gear_error * swing
        qdd[l] -= z[j] + softened(joint, y[l] - y[m] - joint.gear_error * swing)
        moment[j] = command[2, j] + joint.velocity_gain * (command[1, j] - v[m])
        moment[j] += joint.position_gain * (command[0, j] - y[m]) + joint.integral_gain * s[j]
    cholesky(S)
    solve(S, qdd)

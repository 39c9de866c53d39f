"""One control period of arm and drives: the linearly implicit midpoint rule.

M(q) is held for the period at its half-way value and the bias b(q, q̇) runs on, both extrapolated linearly
from the last two ticks; springs, dampers and the drives' gains are implicit, so one Cholesky factor of

    S = M_b + h/2 D + h²/4 (K + h/2 G_i)

serves all substeps of the period (h one substep, M_b = diag(M(q), B), G_i the integral gains). Each substep
solves for the mean acceleration and moves y by the mean velocity: second order, and stable for the fast poles
that light lumps between stiff springs have (about -5e4 1/s), where explicit rules need steps below 0.04 ms.
"""

import numpy as np

from tvist_plant._compiled import compiled
from tvist_plant.model import Floats, Integers


@compiled
def cholesky(S: Floats) -> None:
    """Replace the lower triangle of a positive definite matrix by its Cholesky factor; the rest is left."""
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


@compiled
def advance(  # noqa: C901, PLR0912 - one kernel: its branches are the loops over rows and joints
    y: Floats,
    v: Floats,
    s: Floats,
    a: Floats,
    M: Floats,
    bias: Floats,
    last_M: Floats,
    last_bias: Floats,
    start: Floats,
    end: Floats,
    joints: Integers,
    stiffness: Floats,
    damping: Floats,
    rotor_inertia: Floats,
    velocity_gain: Floats,
    position_gain: Floats,
    integral_gain: Floats,
    friction: Floats,
    friction_width: float,
    gear_stiffness: Floats,
    gear_error: float,
    gear_waves: float,
    gear_phase: Floats,
    period: float,
    substeps: int,
    S: Floats,
    f: Floats,
) -> None:
    """Move the state by one period, in place.

    Args:
        y: Angles, N of the links then n of the motors [rad].
        v: Their velocities [rad/s].
        s: Integrators of the drives, shape (n,) [rad s].
        a: Mean accelerations of the last substep, in and out, shape (N+n,) [rad/s^2].
        M: Mass matrix, upper triangle, shape (N, N) [kg m^2].
        bias: Coriolis, centrifugal and gravity torques at the start, shape (N,) [N m].
        last_M: M one period earlier.
        last_bias: The bias one period earlier.
        start: Rows q_r, q̇_r, τ_ff of the last command, shape (3, n).
        end: Rows of this command.
        joints: Numbers of the n joints among the N link angles.
        stiffness: Of `LinearPart`; so are damping, rotor_inertia and the gains.
        damping: See above.
        rotor_inertia: See above.
        velocity_gain: See above.
        position_gain: See above.
        integral_gain: See above.
        friction: Of `Nonlinear`; so are the four that follow.
        friction_width: See above.
        gear_stiffness: See above.
        gear_error: See above.
        gear_waves: See above.
        gear_phase: Phase φ of each gear's error, shape (n,) [rad].
        period: Control period [s].
        substeps: Number of substeps.
        S: Work, shape (N+n, N+n).
        f: Work, shape (N+n,).
    """
    size, links, n = y.shape[0], M.shape[0], s.shape[0]
    h = period / substeps
    for i in range(size):
        for j in range(i + 1):
            S[i, j] = 0.5 * h * damping[i, j] + 0.25 * h * h * stiffness[i, j]
    for i in range(links):
        for j in range(i + 1):
            S[i, j] += 1.5 * M[j, i] - 0.5 * last_M[j, i]
    for j in range(n):
        S[links + j, links + j] += rotor_inertia[j] + 0.125 * h * h * h * integral_gain[j]
    cholesky(S)

    for step in range(substeps):
        middle = (step + 0.5) / substeps
        for i in range(links):
            f[i] = -bias[i] - middle * (bias[i] - last_bias[i])
        for j in range(n):
            m, l = links + j, joints[j]
            q_r = start[0, j] + middle * (end[0, j] - start[0, j])
            qd_r = start[1, j] + middle * (end[1, j] - start[1, j])
            torque = start[2, j] + middle * (end[2, j] - start[2, j])
            speed = v[m] + 0.5 * h * a[m]
            angle = y[m] + 0.5 * h * speed
            # Friction's slope at rest is implicit in `damping`; what saturates beyond it is put back here.
            slack = friction[j] * (speed / friction_width - np.tanh(speed / friction_width))
            wave = gear_stiffness[j] * gear_error * np.sin(gear_waves * angle + gear_phase[j])
            f[m] = torque + velocity_gain[j] * qd_r + position_gain[j] * q_r + slack - wave
            f[m] += integral_gain[j] * (s[j] + 0.5 * h * q_r)
            f[l] += wave
        for i in range(size):
            value = f[i]
            for j in range(size):
                value -= damping[i, j] * v[j] + stiffness[i, j] * (y[j] + 0.5 * h * v[j])
            a[i] = value
        for j in range(n):
            m = links + j
            a[m] -= 0.5 * h * integral_gain[j] * (y[m] + 0.5 * h * v[m])
        solve(S, a)
        for j in range(n):
            m = links + j
            q_r = start[0, j] + middle * (end[0, j] - start[0, j])
            s[j] += h * (q_r - (y[m] + 0.5 * h * (v[m] + 0.5 * h * a[m])))
        for i in range(size):
            y[i] += h * (v[i] + 0.5 * h * a[i])
            v[i] += h * a[i]


@compiled
def balance(
    y: Floats,
    v: Floats,
    s: Floats,
    M: Floats,
    bias: Floats,
    command: Floats,
    joints: Integers,
    stiffness: Floats,
    damping: Floats,
    velocity_gain: Floats,
    position_gain: Floats,
    integral_gain: Floats,
    gear_stiffness: Floats,
    gear_error: float,
    gear_waves: float,
    gear_phase: Floats,
    S: Floats,
    qdd: Floats,
    moment: Floats,
) -> None:
    """Link accelerations `qdd`, shape (N,), and motor torques `moment`, shape (n,), at a state.

    The other arguments are those of `advance`; `command` is the present one's rows, `S` work.
    """
    size, links, n = y.shape[0], M.shape[0], s.shape[0]
    for i in range(links):
        value = -bias[i]
        for j in range(size):
            value -= stiffness[i, j] * y[j] + damping[i, j] * v[j]
        qdd[i] = value
        for j in range(i + 1):
            S[i, j] = M[j, i]
    for j in range(n):
        m = links + j
        qdd[joints[j]] += gear_stiffness[j] * gear_error * np.sin(gear_waves * y[m] + gear_phase[j])
        moment[j] = command[2, j] + velocity_gain[j] * (command[1, j] - v[m])
        moment[j] += position_gain[j] * (command[0, j] - y[m]) + integral_gain[j] * s[j]
    cholesky(S[:links, :links])
    solve(S[:links, :links], qdd)

"""One control period of the simulated arm, compiled: integration, dynamics, sensors."""

import math
from functools import partial

from tvist_kernels.compiling import compiled
from tvist_plant.arm_memory import ENCODER_STEP, GRAVITY, NOW, ArmMemory, of_joint, parts
from tvist_plant.chain import collect_inertia, collect_torques, sweep
from tvist_plant.integrator import advance, balance
from tvist_plant.model import Floats


@compiled
def move(
    memory: Floats,  # see `arm_memory`
    q: Floats,  # q_r at the end of the period, shape (n,) [rad]
    qd: Floats,  # q̇_r
    torque: Floats,  # feed-forward, shape (n,) [N m]
) -> None:
    """Move the arm by a period, in which drives' commands change linearly from the last to the given ones."""
    arm = parts(memory)
    now = arm.commands[NOW]
    for j in range(q.shape[0]):
        now[0, j], now[1, j], now[2, j] = q[j], qd[j], torque[j]
    advance(arm, memory)


@compiled
def evaluate(
    memory: Floats,  # its `pushed` contains the external torques at this state
    out: Floats,
) -> bool:
    """Compute dynamics, accelerations and measurements at the present state; return whether it is finite.

    `out` becomes encoder angles [rad], joint velocities [rad/s], motor torques [N m] and the flange's
    specific force without noise [m/s^2], shape (3n+3,).
    """
    arm = parts(memory)
    links, n = arm.qdd.shape[0], arm.joints.shape[1]
    y, v = arm.state[0], arm.state[1]
    q, qd, M, qdd = y[:links], v[:links], arm.dynamics[NOW, :links], arm.qdd
    bias = arm.dynamics[NOW, links]
    for i in range(links):
        qdd[i] = 0.0
    sweep(arm.chain, q, qd, qdd, memory[GRAVITY], arm.bodies)
    collect_torques(arm.bodies, bias)
    collect_inertia(arm.bodies, M)
    for i in range(links):
        bias[i] -= arm.pushed[i]
    balance(arm, out[2 * n : 3 * n])
    read(arm, memory[ENCODER_STEP], out)
    total = 0.0
    for i in range(links):
        total += qdd[i] * qdd[i]
    return math.isfinite(total)


@compiled
def read(arm: ArmMemory, step: float, out: Floats) -> None:
    """Read encoders and accelerometer into `out`."""
    links, n, qdd = arm.qdd.shape[0], arm.joints.shape[1], arm.qdd
    y, v = arm.state[0], arm.state[1]
    for j in range(n):
        l = int(of_joint(arm.joints, j).link)
        # Encoder readings change only by at least a step, so that none flickers.
        if not abs(y[l] - arm.readings[j]) < step:  # True for NaN
            arm.readings[j] = y[l]
        out[j], out[n + j] = arm.readings[j], v[l]
    end = arm.bodies[links]
    # The sweep left V, and A without accelerations of the joints, which add S q̈.
    A = end[22:28]
    for i in range(links):
        for k in range(6):
            A[k] += arm.bodies[i, k] * qdd[i]
    a, b, c, x, y_, z = end[16], end[17], end[18], end[9], end[10], end[11]
    # Acceleration of the flange's origin: A + α x p + ω x (v + ω x p), with gravity as an acceleration upwards.
    u, w, t = end[19] + b * z - c * y_, end[20] + c * x - a * z, end[21] + a * y_ - b * x
    f0 = A[3] + A[1] * z - A[2] * y_ + b * t - c * w
    f1 = A[4] + A[2] * x - A[0] * z + c * u - a * t
    f2 = A[5] + A[0] * y_ - A[1] * x + a * w - b * u
    for k in range(3):
        out[3 * n + k] = end[k] * f0 + end[3 + k] * f1 + end[6 + k] * f2


@compiled
def tick(memory: Floats, q: Floats, qd: Floats, torque: Floats, out: Floats) -> bool:
    """Compute one period without external forces: `move`, then `evaluate`."""
    move(memory, q, qd, torque)
    return evaluate(memory, out)


@partial(compiled, nogil=True)  # so that other threads can tick
def play(
    memory: Floats,
    commands: Floats,  # rows q_r, q̇_r and τ_ff of each, shape (T, 3, n)
    measured: Floats,  # result, as in `evaluate`, shape (T, 3n+3)
    flange: Floats,  # result: its rotation and position after each period, shape (T, 12)
) -> int:
    """Compute T periods as `tick` does; return T, or their number before the state stopped being finite."""
    T: int = commands.shape[0]
    for k in range(T):
        if not tick(memory, commands[k, 0], commands[k, 1], commands[k, 2], measured[k]):
            return k
        end = parts(memory).bodies[-1]
        for i in range(12):
            flange[k, i] = end[i]
    return T

"""A second way to move the arm: classical Runge-Kutta on pinocchio's articulated-body algorithm."""

import itertools

import numpy as np
import pinocchio as pin
import ruckig

from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import flexible_model, rigid_model

TICK = 0.002


def double_s(start, target, ticks):
    """The paper's point-to-point motion sampled at the tick: q, q̇, q̈, each [ticks, n]."""
    n = len(start)
    request = ruckig.InputParameter(n)
    request.current_position, request.target_position = list(start), list(target)
    request.max_velocity, request.max_acceleration, request.max_jerk = [1.5] * n, [2.0] * n, [100.0] * n
    request.synchronization = ruckig.Synchronization.Phase
    trajectory = ruckig.Trajectory(n)
    ruckig.Ruckig(n).calculate(request, trajectory)
    rows = [trajectory.at_time(min(i * TICK, trajectory.duration))[:3] for i in range(ticks)]
    return (np.array([row[k] for row in rows]) for k in range(3))


def commands(description: RobotDescription, start, target, ticks) -> list[DriveCommand]:
    """The motion with the rigid arm's inverse dynamics fed forward."""
    model = rigid_model(description, description.payload)
    data = model.createData()
    return [
        DriveCommand(q, qd, pin.rnea(model, data, q, qd, qdd).copy())
        for q, qd, qdd in zip(*double_s(start, target, ticks), strict=True)
    ]


def between(last: DriveCommand, new: DriveCommand, share: float) -> DriveCommand:
    return DriveCommand(
        *(getattr(last, f) + share * (getattr(new, f) - getattr(last, f)) for f in ("q", "qd", "torque"))
    )


def runge_kutta(description: RobotDescription, drive: list[DriveCommand], step: float):
    """Specific force at every tick and the last link angles, started like the plant in static equilibrium."""
    arm = flexible_model(description, description.payload)
    model, data = arm.model, arm.model.createData()
    drives, n, N = description.drives, len(arm.joints), arm.model.nv
    K_g, D_g, B = (np.array(x) for x in (drives.gear_stiffness, drives.gear_damping, drives.rotor_inertia))
    K_d, K_p, K_i = (np.array(x) for x in (drives.velocity_gain, drives.position_gain, drives.integral_gain))
    F_c, w = np.array(drives.coulomb_friction), drives.friction_width

    def slope(x, command):
        q, theta, v, omega, s = np.split(x, [N, N + n, 2 * N + n, 2 * N + 2 * n])
        gear = K_g * (q[arm.joints] - theta) + D_g * (v[arm.joints] - omega)
        tau = np.zeros(N)
        tau[arm.joints] = -gear
        tau[arm.flexes] = -arm.flex_stiffness * q[arm.flexes] - arm.flex_damping * v[arm.flexes]
        off = command.q - theta
        motor = command.torque + K_d * (command.qd - omega + (K_p + K_i) * off + K_p * K_i * s)
        omega_dot = (motor + gear - F_c * (omega / w if drives.linear_friction else np.tanh(omega / w))) / B
        return np.concatenate([v, omega, pin.aba(model, data, q, v, tau), omega_dot, off]), tau

    first = drive[0]
    q = np.zeros(N)
    for _ in range(50):
        gravity = pin.computeGeneralizedGravity(model, data, q)
        q[arm.joints] = first.q - gravity[arm.joints] / K_g
        q[arm.flexes] = -gravity[arm.flexes] / arm.flex_stiffness
    s = (gravity[arm.joints] - first.torque) / (K_d * K_p * K_i)
    x = np.concatenate([q, first.q, np.zeros(N + n), s])
    felt = []
    count = round(TICK / step)
    for last, new in itertools.pairwise(drive):
        for k in range(count):
            a, b, c = (between(last, new, (k + p) / count) for p in (0.0, 0.5, 1.0))
            k1 = slope(x, a)[0]
            k2 = slope(x + step / 2 * k1, b)[0]
            k3 = slope(x + step / 2 * k2, b)[0]
            k4 = slope(x + step * k3, c)[0]
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        tau = slope(x, new)[1]
        q, v = x[:N], x[N + n : 2 * N + n]
        qdd = pin.aba(model, data, q, v, tau)
        pin.forwardKinematics(model, data, q, v, qdd)
        placement = pin.updateFramePlacement(model, data, arm.flange)
        acceleration = pin.getFrameClassicalAcceleration(model, data, arm.flange, pin.LOCAL).linear
        felt.append(acceleration - placement.rotation.T @ model.gravity.linear)
    return np.array(felt), x[:N]

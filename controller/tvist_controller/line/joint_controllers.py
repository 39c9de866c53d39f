"""Commands to the drives: set-points with feed-forward. The feedback control is in the drives."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_kernels.compiling import inlined
from tvist_plant.description import RobotDescription
from tvist_plant.drives import joint_parameters
from tvist_plant.plant import PERIOD
from tvist_plant.stiction import stiction_after

LAWS = 9
"""Number of parameters of known friction: F_c [N m], F_s/F_c [-], v_s [rad/s], w [rad/s], F_v [N m s/rad];
and stiction as in `Imperfections`, zero for none: F_s [N m], μ_s [-], v_s [rad/s], σ K_g [N m/rad]."""
ROTOR, COMPLIANCE, YIELDING, COULOMB, VISCOUS, WIDTH, PER_SECOND, WINDUP, STICTION, LAW = range(10)
"""Rows of each joint's parameters: B [kg m^2], c_w/K_g [rad/(N m)], 1/K_g for sag compensation [rad/(N m)], Coulomb [N
m] and viscous friction [N m s/rad], Coulomb width [rad/s], 1/h [1/s]; wind-up [rad] and stiction [N m] of the last
tick; first row of the known friction, see `LAWS`, which replaces the other friction unless its w is zero."""
ROWS = LAW + LAWS


@compiled_for_ticks
def friction_at(law: Floats, j: int, speed: float) -> float:
    """Return sliding friction, [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w) + F_v v [N m] (Stribeck)."""
    slow = speed / law[2, j]
    coulomb = law[0, j] * (1.0 + (law[1, j] - 1.0) * math.exp(-slow * slow))
    return float(coulomb * math.tanh(speed / law[3, j]) + law[4, j] * speed)


@compiled_for_ticks
def stiction_at(law: Floats, j: int, d: float, period: float, speed: float, load: float) -> float:
    """Return a motor's stiction [N m] at a period's end, from `d` at its start, by the plant's equation."""
    return stiction_after(d, period * speed, speed, load, law[5, j], law[6, j], law[7, j], law[8, j])


@compiled_for_ticks
def sticks(law: Floats, j: int) -> bool:
    """Return whether a law has stiction. If not, old stiction stays: a torque step would shake the arm."""
    return bool(law[5, j] > 0.0 or law[6, j] > 0.0)


@inlined
def command_drives(
    q: Floats,  # q*, shape (n,) [rad]
    rates: Floats,  # q̇* and q̈*, shape (2, n)
    torque: Floats,  # τ* of the rigid arm, shape (n,) [N m]
    gravity: Floats,  # g(q*), shape (n,) [N m]
    joints: Floats,  # parameters of each joint, shape (19, n); wind-up and stiction are changed
    command: Floats,  # result: position [rad], velocity [rad/s] and feed-forward torque [N m], shape (3, n)
) -> None:
    """Compute the drive command for a target.

    - Torque: τ_ff = τ* + B q̈* + friction: rigid arm, rotor inertia and a fraction of Coulomb friction. Known friction
    counts in full, at motor speed, as does stiction.
    - Wind-up: a gear that transmits τ - g twists by (τ - g)/K_g; the motor leads by a fraction c_w of it.
    - Sag: the twist g/K_g under gravity is left, as on the paper's robot, or compensated in full. g(q*) has neither
    feedback nor delay, and is as smooth as q*.
    """
    law = joints[LAW:]
    for j in range(q.shape[0]):
        windup = joints[COMPLIANCE, j] * (torque[j] - gravity[j]) + joints[YIELDING, j] * gravity[j]
        speed = (windup - joints[WINDUP, j]) * joints[PER_SECOND, j]
        joints[WINDUP, j] = windup
        if sticks(law, j):
            d, period = joints[STICTION, j], 1.0 / joints[PER_SECOND, j]
            joints[STICTION, j] = stiction_at(law, j, d, period, rates[0, j] + speed, torque[j])
        if law[3, j] > 0.0:
            friction = friction_at(law, j, rates[0, j] + speed)
        else:
            friction = joints[VISCOUS, j] * rates[0, j]
            if joints[COULOMB, j] > 0.0:
                friction += joints[COULOMB, j] * math.tanh(rates[0, j] / joints[WIDTH, j])
        command[0, j] = q[j] + windup
        command[1, j] = rates[0, j] + speed
        command[2, j] = torque[j] + joints[ROTOR, j] * rates[1, j] + friction + joints[STICTION, j]


def joint_rows(description: RobotDescription, *, compensate_sag: bool, positions: bool) -> Floats:
    """Return joint parameters in rows `ROTOR` etc., shape (19, n); `positions` leaves out wind-up and sag."""
    drives = description.drives
    friction, stiffness = np.array(drives.coulomb_friction), np.array(drives.gear_stiffness)
    rows = np.zeros((ROWS, description.joints))
    rows[ROTOR] = drives.rotor_inertia
    if not positions:
        rows[COMPLIANCE] = np.array(drives.windup_feedforward) / stiffness
        rows[YIELDING] = compensate_sag / stiffness
    if drives.linear_friction:
        rows[VISCOUS] = friction / drives.friction_width
    else:
        rows[COULOMB] = drives.friction_feedforward * friction
    rows[WIDTH], rows[PER_SECOND] = drives.friction_feedforward_width, 1.0 / PERIOD
    return rows


def described_friction(description: RobotDescription) -> Floats | None:
    """Return the described friction of an arm with stiction, rows as `LAWS`, shape (9, n); else None."""
    sticks, drives = joint_parameters(description, description.imperfections), description.drives
    if not sticks.stiction_load.any() and not sticks.stiction.any():
        return None
    F_c, w, linear = np.array(drives.coulomb_friction), drives.friction_width, drives.linear_friction
    rows = (
        0.0 if linear else F_c, 1.0, 1.0, w, F_c / w if linear else 0.0,
        sticks.stiction, sticks.stiction_load, sticks.stiction_speed, sticks.stiction_stiffness,
    )  # fmt: skip
    return np.array([np.full(description.joints, row) for row in rows])

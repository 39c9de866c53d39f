"""Commands to the drives: set-points with their feed-forward; feedback control runs in the drives themselves."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_kernels.compiling import inlined
from tvist_plant.description import RobotDescription
from tvist_plant.imperfections import GearLaw, Imperfections
from tvist_plant.stiction import stiction_after

LAWS = 9
"""Number of parameters of known friction: F_c [N m], F_s/F_c [-], v_s [rad/s], w [rad/s], F_v [N m s/rad]; and of the
stiction of `Imperfections`, all zero if the motors do not stick: F_s [N m], μ_s [-], v_s [rad/s], σ K_g [N m/rad].
"""
ROTOR, COMPLIANCE, YIELDING, COULOMB, VISCOUS, WIDTH, PER_SECOND, WINDUP, STICTION, LAW = range(10)
"""Rows of the parameters of each joint: rotor inertia B [kg m^2], c_w/K_g [rad/(N m)], 1/K_g if the sag is compensated
[rad/(N m)], Coulomb [N m] and viscous friction [N m s/rad], speed over which the former changes its sign [rad/s], 1/h
[1/s]; the wind-up [rad] and the stiction [N m] of the last tick; and the first row of the known friction, see `LAWS`,
which counts instead of the friction before it. Its w is zero if none is known.
"""
ROWS = LAW + LAWS
"""Number of rows."""


@compiled_for_ticks
def friction_at(law: Floats, j: int, speed: float) -> float:
    """Return sliding friction at a motor's speed: [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w) + F_v v [N m].

    Source: Stribeck. A law has the parameters of each joint in the order of `LAWS`, shape (9, n).
    """
    slow = speed / law[2, j]
    coulomb = law[0, j] * (1.0 + (law[1, j] - 1.0) * math.exp(-slow * slow))
    friction: float = coulomb * math.tanh(speed / law[3, j]) + law[4, j] * speed
    return friction


@compiled_for_ticks
def stiction_at(law: Floats, j: int, d: float, period: float, speed: float, load: float) -> float:
    """Return the stiction of a motor that had d and turns at a speed for a period, under a load in its gear [N m].

    This is the plant's equation along the commanded motion.
    """
    return stiction_after(d, period * speed, speed, load, law[5, j], law[6, j], law[7, j], law[8, j])


@compiled_for_ticks
def sticks(law: Floats, j: int) -> bool:
    """Whether a law has stiction; otherwise that of the last tick stays, since a torque that ends shakes the arm."""
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

    - Torque: τ_ff = τ* + B q̈* + friction; the rotors' inertia and a share of Coulomb friction are added to the
      torque of the rigid arm. Friction that is known counts in full, at the speed of the motors, and so does stiction.
    - Wind-up: a gear that transmits τ - g twists by (τ - g)/K_g. The motor leads by a share c_w of that, so that the
      link is closer to its reference.
    - Sag: the twist by gravity itself, g/K_g, is left, as on the paper's robot, or the motor leads by all of it, so
      that the link rests on its reference. g(q*) has neither feedback nor a delay, and is as smooth as q*.
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


def joint_rows(
    description: RobotDescription, period: float, *, compensate_sag: bool = False, positions: bool = False
) -> Floats:
    """Return the parameters of each joint, in the order of `ROTOR` and so on, shape (19, n).

    The motors lead by the twist of the gears under gravity to compensate sag. With `positions`, the command
    is the reference, without wind-up and sag, since the arm's own controller adds these.
    """
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
    rows[WIDTH], rows[PER_SECOND] = drives.friction_feedforward_width, 1.0 / period
    return rows


def described_friction(description: RobotDescription) -> Floats | None:
    """Return the friction in a robot file whose motors stick, rows as in `LAWS`, shape (9, n); None if they do not."""
    sticks, drives = GearLaw.of(Imperfections.of(description), description), description.drives
    if sticks.stiction_load == 0.0 and not sticks.stiction.any():
        return None
    F_c, w, linear = np.array(drives.coulomb_friction), drives.friction_width, drives.linear_friction
    rows = (
        0.0 if linear else F_c, 1.0, 1.0, w, F_c / w if linear else 0.0,
        sticks.stiction, sticks.stiction_load, sticks.stiction_speed, sticks.stiction_stiffness,
    )  # fmt: skip
    return np.array([np.full(description.joints, row) for row in rows])

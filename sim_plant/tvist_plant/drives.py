"""The drives' commands at each tick, and the parameters of drives and gears.

Equations (joint side, one joint j; y = (q, θ) are link-side and motor-side angles):

    link    M(q) q̈ + b(q, q̇) = -K_g (q_j - θ - e(θ)) - D_g (q̇_j - θ̇)   and  -k_l q_f - d_l q̇_f  where it bends
    motor   B θ̈ = τ_m + K_g (q_j - θ - e(θ)) + D_g (q̇_j - θ̇) - F_c tanh(θ̇/w)
    drive   τ_m = τ_ff + K_d [q̇_r - θ̇ + K_p (q_r - θ) + K_i (q_r - θ) + K_p K_i s],     ṡ = q_r - θ
    gear    e(θ) = ε sin(n_w θ + φ)

Each drive is a cascade of P on position and PI on velocity, closed on the motor side. The motor's impedance
is in series with the gear's spring, so damping decreases as frequency increases (Table 1 of the paper).
"""

from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from tvist_plant.imperfections import Imperfections
from tvist_plant.model import FlexibleModel, Floats, Integers
from tvist_plant.robot_tables import Drives, RobotDescription

T = TypeVar("T")
TOUCH = 1e-6  # torque below which a gear at rest lies within its backlash [N m]


@dataclass(slots=True, eq=False)
class DriveCommand:
    """Set-points of all drives for the end of a tick, interpolated linearly from the previous ones.

    Not frozen, because creating a frozen one at every tick takes five times as long.
    """

    q: Floats  # position q_r, shape (n,) [rad]
    qd: Floats  # velocity q̇_r, shape (n,) [rad/s]
    torque: Floats  # feed-forward torque τ_ff, shape (n,) [N m]


class JointParameters(NamedTuple, Generic[T]):
    """Parameters of the drive and gear of one joint (floats), or of all joints (arrays of shape (n,))."""

    rotor_inertia: T  # B [kg m^2]
    velocity_gain: T  # K_d [N m s/rad]
    position_gain: T  # K_d (K_p + K_i) [N m/rad]
    integral_gain: T  # K_d K_p K_i [N m/(rad s)]
    friction: T  # F_c; zero if friction is modelled as linear [N m]
    friction_width: T  # w [rad/s]
    breakaway: T  # F_s/F_c [-]
    stribeck_speed: T  # v_s [rad/s]
    link: T  # index of the joint's link, as a float [-]
    gear_stiffness: T  # K_g, called K in `imperfections` [N m/rad]
    gear_damping: T  # D_g [N m s/rad]
    gear_error: T  # amplitude ε of the gear's kinematic error [rad]
    gear_waves: T  # n_w [-]
    gear_phase: T  # φ [rad]
    softness: T  # K - K₁ [N m/rad]
    soft_angle: T  # δ₁ [rad]
    hysteresis: T  # r K [N m/rad]
    hysteresis_torque: T  # z_max [N m]
    backlash: T  # b [rad]
    stiction: T  # F_s of the stiction [N m]
    stiction_load: T  # μ_s [-]
    stiction_speed: T  # v_s of the stiction [rad/s]
    stiction_stiffness: T  # σ K [N m/rad]


def joint_parameters(
    description: RobotDescription, imperfections: Imperfections, links: Integers | int = 0
) -> JointParameters[Floats]:
    """Return an arm's parameters, with phases 0; raise ValueError unless lists have one value per joint."""
    n, drives, limit = description.joints, description.drives, np.array(description.limits.torque)
    K, K_d, K_p, K_i = map(
        np.array,
        (drives.gear_stiffness, drives.velocity_gain, drives.position_gain, drives.integral_gain),
    )
    lists = {name: np.array(getattr(imperfections, name) or np.zeros(n)) for name in ("backlash", "stiction")}
    for name, values in lists.items():
        if len(values) != n:
            raise ValueError(f"{name} has {len(values)} values: must have {n}, one per joint")
    rows = JointParameters[Any](
        rotor_inertia=imperfections.rotor * np.array(drives.rotor_inertia),
        velocity_gain=K_d,
        position_gain=K_d * (K_p + K_i),
        integral_gain=K_d * K_p * K_i,
        friction=np.array(drives.coulomb_friction) * (not drives.linear_friction),
        friction_width=drives.friction_width,
        breakaway=imperfections.breakaway,
        stribeck_speed=imperfections.stribeck_speed,
        link=links,
        gear_stiffness=K,
        gear_damping=drives.gear_damping,
        gear_error=drives.gear_error_amplitude,
        gear_waves=drives.gear_error_waves,
        gear_phase=0.0,
        softness=(1.0 - imperfections.soft) * K,
        soft_angle=imperfections.soft_torque * limit / (imperfections.soft * K),
        hysteresis=imperfections.hysteresis * K,
        hysteresis_torque=imperfections.hysteresis_torque * limit,
        stiction_load=imperfections.stiction_load,
        stiction_speed=imperfections.stiction_speed,
        stiction_stiffness=imperfections.stiction_stiffness * K,
        **lists,
    )
    return JointParameters(*(np.full(n, row, dtype=float) for row in rows))


def static_twist(joints: JointParameters[Floats], torque: Floats) -> Floats:
    """Return each gear's twist under a steady torque [N m] without hysteresis [rad]."""
    stiffness = joints.gear_stiffness
    if not joints.softness.any() and not joints.backlash.any():
        return torque / stiffness
    soft = stiffness - joints.softness
    within = np.minimum(np.abs(torque) / soft, joints.soft_angle)
    beyond = np.maximum(np.abs(torque) - soft * joints.soft_angle, 0.0)
    loose = joints.backlash * np.clip(torque / TOUCH, -1.0, 1.0)
    return np.asarray(loose + np.sign(torque) * (within + beyond / stiffness))


def gear_error(joints: JointParameters[Floats], motor: Floats) -> Floats:
    """Return the kinematic errors of the gears at motor angles [rad]."""
    return np.asarray(joints.gear_error * np.sin(joints.gear_waves * motor + joints.gear_phase))


def springs_and_dampers(
    flexible: FlexibleModel, joints: JointParameters[Floats], drives: Drives
) -> tuple[Floats, Floats]:
    """Return stiffness [N m/rad] and damping [N m s/rad] of N links, then n motors, shape (N+n, N+n) each.

    Both matrices are the same in any posture and include the drives' gains and the slope of friction at rest.
    """
    size, link = flexible.model.nv, flexible.joints
    motor = size + np.arange(len(link))
    stiffness, damping = np.zeros((2, size + len(link), size + len(link)))
    for matrix, spring in ((stiffness, joints.gear_stiffness), (damping, joints.gear_damping)):
        matrix[link, link] += spring
        matrix[motor, motor] += spring
        matrix[link, motor] -= spring
        matrix[motor, link] -= spring
    stiffness[flexible.flexes, flexible.flexes] += flexible.flex_stiffness
    damping[flexible.flexes, flexible.flexes] += flexible.flex_damping
    stiffness[motor, motor] += joints.position_gain
    damping[motor, motor] += joints.velocity_gain + np.array(drives.coulomb_friction) / drives.friction_width
    return stiffness, damping

"""The drives' commands at each tick, and the linear part of arm and drives together.

Equations (joint side, one joint j; y = (q, θ) are link-side and motor-side angles):

    link    M(q) q̈ + b(q, q̇) = -K_g (q_j - θ - e(θ)) - D_g (q̇_j - θ̇)   and  -k_l q_f - d_l q̇_f  where it bends
    motor   B θ̈ = τ_m + K_g (q_j - θ - e(θ)) + D_g (q̇_j - θ̇) - F_c tanh(θ̇/w)
    drive   τ_m = τ_ff + K_d [q̇_r - θ̇ + K_p (q_r - θ) + K_i (q_r - θ) + K_p K_i s],     ṡ = q_r - θ
    gear    e(θ) = ε sin(n_w θ + φ)

Each drive is a cascade of P on position and PI on velocity, closed on the motor side. The motor's impedance
is in series with the gear's spring, so damping decreases as frequency increases (Table 1 of the paper).
"""

from dataclasses import dataclass

import numpy as np

from tvist_plant.description import Drives
from tvist_plant.model import FlexibleModel, Floats


@dataclass(slots=True, eq=False)
class DriveCommand:
    """Set-points of all drives for the end of a tick, interpolated linearly from the previous ones.

    Not frozen, because creating a frozen one at every tick takes five times as long.
    """

    q: Floats  # position q_r, shape (n,) [rad]
    qd: Floats  # velocity q̇_r, shape (n,) [rad/s]
    torque: Floats  # feed-forward torque τ_ff, shape (n,) [N m]


@dataclass(frozen=True)
class LinearPart:
    """Stiffness, damping and gains of arm and drives, the same in every posture; N links, then n motors."""

    stiffness: Floats  # springs and position gains, shape (N+n, N+n) [N m/rad]
    damping: Floats  # dampers, velocity gains and the slope of friction at rest, shape (N+n, N+n) [N m s/rad]
    gear_damping: Floats  # d_g, shape (n,) [N m s/rad]
    rotor_inertia: Floats  # b, shape (n,) [kg m^2]
    velocity_gain: Floats  # k_d, shape (n,) [N m s/rad]
    position_gain: Floats  # k_d (K_p + K_i), shape (n,) [N m/rad]
    integral_gain: Floats  # k_d K_p K_i, shape (n,) [N m/(rad s)]

    @classmethod
    def of(cls, flexible: FlexibleModel, drives: Drives) -> "LinearPart":
        """Assemble the matrices."""
        links, joints = flexible.model.nv, len(flexible.joints)
        gear, gear_damping = np.array(drives.gear_stiffness), np.array(drives.gear_damping)
        K_d, K_p, K_i = map(np.array, (drives.velocity_gain, drives.position_gain, drives.integral_gain))
        friction = np.array(drives.coulomb_friction) / drives.friction_width
        stiffness, damping = np.zeros((2, links + joints, links + joints))
        link, motor = flexible.joints, links + np.arange(joints)
        for matrix, spring in ((stiffness, gear), (damping, gear_damping)):
            matrix[link, link] += spring
            matrix[motor, motor] += spring
            matrix[link, motor] -= spring
            matrix[motor, link] -= spring
        stiffness[flexible.flexes, flexible.flexes] += flexible.flex_stiffness
        damping[flexible.flexes, flexible.flexes] += flexible.flex_damping
        stiffness[motor, motor] += K_d * (K_p + K_i)
        damping[motor, motor] += K_d + friction
        return cls(
            stiffness=stiffness,
            damping=damping,
            gear_damping=gear_damping,
            rotor_inertia=np.array(drives.rotor_inertia),
            velocity_gain=K_d,
            position_gain=K_d * (K_p + K_i),
            integral_gain=K_d * K_p * K_i,
        )


@dataclass(frozen=True)
class Nonlinear:
    """Friction and gear error, one entry per joint."""

    friction: Floats  # f_c, shape (n,); zero if the file models friction as linear [N m]
    friction_width: float  # w [rad/s]
    gear_stiffness: Floats  # k_g, shape (n,) [N m/rad]
    gear_error: float  # amplitude ε [rad]
    gear_waves: float  # n_w [-]

    @classmethod
    def of(cls, drives: Drives) -> "Nonlinear":
        """Take the values from the robot's description."""
        return cls(
            friction=np.array(drives.coulomb_friction) * (not drives.linear_friction),
            friction_width=drives.friction_width,
            gear_stiffness=np.array(drives.gear_stiffness),
            gear_error=drives.gear_error_amplitude,
            gear_waves=drives.gear_error_waves,
        )

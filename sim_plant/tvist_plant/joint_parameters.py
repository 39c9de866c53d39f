"""What the kernel knows of each joint's drive and gear: one array, whose rows have names on both sides.

A kernel takes few arguments, since numba looks at the type of each at every call: 20 arrays cost twice as much as 8,
and a NamedTuple more than its arrays one by one. So the parameters travel in one array, and get their names back in
the kernel, where a NamedTuple costs nothing.
"""

from typing import NamedTuple

import numpy as np

from tvist_plant._compiled import compiled
from tvist_plant.drives import LinearPart, Nonlinear
from tvist_plant.imperfections import GearLaw
from tvist_plant.model import Floats


class JointParameters(NamedTuple):
    """Parameters of the joints, each of shape (n,)."""

    rotor_inertia: Floats
    """B [kg m^2]."""
    velocity_gain: Floats
    """K_d [N m s/rad]."""
    position_gain: Floats
    """K_d (K_p + K_i) [N m/rad]."""
    integral_gain: Floats
    """K_d K_p K_i [N m/(rad s)]."""
    friction: Floats
    """F_c; zero where friction is taken as linear [N m]."""
    friction_width: Floats
    """w [rad/s]."""
    breakaway: Floats
    """F_s/F_c [-]."""
    stribeck_speed: Floats
    """v_s [rad/s]."""
    gear_stiffness: Floats
    """K [N m/rad]."""
    gear_error: Floats
    """Amplitude ε of the gear's kinematic error [rad]."""
    gear_waves: Floats
    """n_w [-]."""
    gear_phase: Floats
    """φ [rad]."""
    softness: Floats
    """K - K₁ [N m/rad]."""
    soft_angle: Floats
    """δ₁ [rad]."""
    hysteresis: Floats
    """r K [N m/rad]."""
    hysteresis_torque: Floats
    """z_max [N m]."""


@compiled
def named(rows: Floats) -> JointParameters:
    """Give the rows of an array their names; they stay views of it."""
    return JointParameters(
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7],
        rows[8], rows[9], rows[10], rows[11], rows[12], rows[13], rows[14], rows[15],
    )  # fmt: skip


def packed(linear: LinearPart, nonlinear: Nonlinear, law: GearLaw, gear_phase: Floats) -> Floats:
    """One array of all parameters, shape (16, n), for `named`.

    Args:
        linear: Gains and rotors.
        nonlinear: Friction and gear errors.
        law: What friction and gears have that the description does not say.
        gear_phase: Phase of each gear's error, shape (n,) [rad].
    """
    n = len(gear_phase)
    return np.array(
        JointParameters(
            rotor_inertia=linear.rotor_inertia,
            velocity_gain=linear.velocity_gain,
            position_gain=linear.position_gain,
            integral_gain=linear.integral_gain,
            friction=nonlinear.friction,
            friction_width=np.full(n, nonlinear.friction_width),
            breakaway=np.full(n, law.breakaway),
            stribeck_speed=np.full(n, law.stribeck_speed),
            gear_stiffness=nonlinear.gear_stiffness,
            gear_error=np.full(n, nonlinear.gear_error),
            gear_waves=np.full(n, nonlinear.gear_waves),
            gear_phase=gear_phase,
            softness=law.softness,
            soft_angle=law.soft_angle,
            hysteresis=law.hysteresis,
            hysteresis_torque=law.hysteresis_torque,
        )
    )

"""Parameters of each joint's drive and gear for the kernel: one array, whose columns get names in the kernel.

A kernel should have few arguments, since numba checks the type of each at every call: 20 arrays take twice as long as
8, and a NamedTuple takes longer than its arrays separately. So the parameters are passed in one array, and get their
names back in the kernel, where a NamedTuple of numbers costs nothing.
"""

from typing import NamedTuple

import numpy as np

from tvist_plant._compiled import compiled
from tvist_plant.drives import LinearPart, Nonlinear
from tvist_plant.imperfections import GearLaw
from tvist_plant.model import Floats


class JointParameters(NamedTuple):
    """Parameters of one joint."""

    rotor_inertia: float
    """B [kg m^2]."""
    velocity_gain: float
    """K_d [N m s/rad]."""
    position_gain: float
    """K_d (K_p + K_i) [N m/rad]."""
    integral_gain: float
    """K_d K_p K_i [N m/(rad s)]."""
    friction: float
    """F_c; zero if friction is modelled as linear [N m]."""
    friction_width: float
    """w [rad/s]."""
    breakaway: float
    """F_s/F_c [-]."""
    stribeck_speed: float
    """v_s [rad/s]."""
    gear_stiffness: float
    """K [N m/rad]."""
    gear_error: float
    """Amplitude ε of the gear's kinematic error [rad]."""
    gear_waves: float
    """n_w [-]."""
    gear_phase: float
    """φ [rad]."""
    softness: float
    """K - K₁ [N m/rad]."""
    soft_angle: float
    """δ₁ [rad]."""
    hysteresis: float
    """r K [N m/rad]."""
    hysteresis_torque: float
    """z_max [N m]."""


@compiled
def of_joint(parameters: Floats, j: int) -> JointParameters:
    """Return the parameters of joint j from the array that `packed` created."""
    return JointParameters(
        parameters[0, j], parameters[1, j], parameters[2, j], parameters[3, j],
        parameters[4, j], parameters[5, j], parameters[6, j], parameters[7, j],
        parameters[8, j], parameters[9, j], parameters[10, j], parameters[11, j],
        parameters[12, j], parameters[13, j], parameters[14, j], parameters[15, j],
    )  # fmt: skip


def packed(linear: LinearPart, nonlinear: Nonlinear, law: GearLaw, gear_phase: Floats) -> Floats:
    """Return one array of all parameters, one row each in the order of `JointParameters`, shape (16, n).

    Args:
        linear: Gains and rotors.
        nonlinear: Friction and gear errors.
        law: Imperfections of friction and gears.
        gear_phase: Phase of each gear's error, shape (n,) [rad].
    """
    rows = {
        "rotor_inertia": linear.rotor_inertia,
        "velocity_gain": linear.velocity_gain,
        "position_gain": linear.position_gain,
        "integral_gain": linear.integral_gain,
        "friction": nonlinear.friction,
        "friction_width": nonlinear.friction_width,
        "breakaway": law.breakaway,
        "stribeck_speed": law.stribeck_speed,
        "gear_stiffness": nonlinear.gear_stiffness,
        "gear_error": nonlinear.gear_error,
        "gear_waves": nonlinear.gear_waves,
        "gear_phase": gear_phase,
        "softness": law.softness,
        "soft_angle": law.soft_angle,
        "hysteresis": law.hysteresis,
        "hysteresis_torque": law.hysteresis_torque,
    }
    return np.array([np.full(len(gear_phase), rows[name]) for name in JointParameters._fields])

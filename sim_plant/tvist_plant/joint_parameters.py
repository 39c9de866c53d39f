"""Parameters of each joint's drive and gear: one array for the kernel, which names its columns at no cost."""

from typing import NamedTuple

import numpy as np

from tvist_plant._compiled import compiled
from tvist_plant.drives import LinearPart, Nonlinear
from tvist_plant.imperfections import GearLaw
from tvist_plant.model import Floats, Integers


class JointParameters(NamedTuple):
    """Parameters of one joint."""

    rotor_inertia: float  # b [kg m^2]
    velocity_gain: float  # k_d [N m s/rad]
    position_gain: float  # k_d (K_p + K_i) [N m/rad]
    integral_gain: float  # k_d K_p K_i [N m/(rad s)]
    friction: float  # f_c; zero if friction is modelled as linear [N m]
    friction_width: float  # w [rad/s]
    breakaway: float  # f_s/F_c [-]
    stribeck_speed: float  # v_s [rad/s]
    link: float  # index of its link, as a float [-]
    gear_stiffness: float  # k [N m/rad]
    gear_damping: float  # d [N m s/rad]
    gear_error: float  # amplitude ε of the gear's kinematic error [rad]
    gear_waves: float  # n_w [-]
    gear_phase: float  # φ [rad]
    softness: float  # k - K₁ [N m/rad]
    soft_angle: float  # δ₁ [rad]
    hysteresis: float  # r K [N m/rad]
    hysteresis_torque: float  # z_max [N m]
    backlash: float  # b [rad]
    stiction: float  # f_s of the stiction [N m]
    stiction_load: float  # μ_s [-]
    stiction_speed: float  # v_s of the stiction [rad/s]
    stiction_stiffness: float  # σ K [N m/rad]


ROWS = len(JointParameters._fields)


@compiled
def of_joint(parameters: Floats, j: int) -> JointParameters:
    """Return the parameters of joint j from the array of `packed`."""
    return JointParameters(
        parameters[0, j], parameters[1, j], parameters[2, j], parameters[3, j],
        parameters[4, j], parameters[5, j], parameters[6, j], parameters[7, j],
        parameters[8, j], parameters[9, j], parameters[10, j], parameters[11, j],
        parameters[12, j], parameters[13, j], parameters[14, j], parameters[15, j],
        parameters[16, j], parameters[17, j], parameters[18, j], parameters[19, j],
        parameters[20, j], parameters[21, j], parameters[22, j],
    )  # fmt: skip


def packed(
    joints: Integers, linear: LinearPart, nonlinear: Nonlinear, law: GearLaw, gear_phase: Floats
) -> Floats:
    """Return one array with a row per field of `JointParameters`, shape (23, n); phase in [rad]."""
    rows = {
        "rotor_inertia": linear.rotor_inertia,
        "velocity_gain": linear.velocity_gain,
        "position_gain": linear.position_gain,
        "integral_gain": linear.integral_gain,
        "friction": nonlinear.friction,
        "friction_width": nonlinear.friction_width,
        "breakaway": law.breakaway,
        "stribeck_speed": law.stribeck_speed,
        "link": joints,
        "gear_stiffness": nonlinear.gear_stiffness,
        "gear_damping": linear.gear_damping,
        "gear_error": nonlinear.gear_error,
        "gear_waves": nonlinear.gear_waves,
        "gear_phase": gear_phase,
        "softness": law.softness,
        "soft_angle": law.soft_angle,
        "hysteresis": law.hysteresis,
        "hysteresis_torque": law.hysteresis_torque,
        "backlash": law.backlash,
        "stiction": law.stiction,
        "stiction_load": law.stiction_load,
        "stiction_speed": law.stiction_speed,
        "stiction_stiffness": law.stiction_stiffness,
    }
    return np.array([np.full(len(gear_phase), rows[name]) for name in JointParameters._fields])

"""Vibration modes of arm and drives, linearised: the reference for estimators, unknown on real arms."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tvist_plant.description import RobotDescription
from tvist_plant.drives import JointParameters, springs_and_dampers
from tvist_plant.model import FlexibleModel, Floats


@dataclass(frozen=True)
class Modes:
    """Oscillatory modes in ascending frequency; arrays have one entry per mode."""

    f_d: Floats  # damped frequencies [Hz]
    zeta: Floats  # damping ratios [-]
    participation: Floats
    """Amplitude of the flange acceleration after a step of 1 rad/s² in a joint's reference acceleration, root
    sum of squares over joints and axes [m/s^2 per rad/s^2]."""


def modes(
    flexible: FlexibleModel, joints: JointParameters[Floats], description: RobotDescription, q: Floats
) -> Modes:
    """Linearise the closed loop at rest at link angles of shape (N,) [rad], and solve its eigenvalue problem.

    With z = (y, ẏ, s), y = (q, θ): M_b ÿ = -(K + ∂g/∂q) y - D ẏ + K_d K_p K_i s and ṡ = -θ. A complex pair λ
    = -σ ± iω gives f_d = ω/2π and ζ = σ/|λ|. The description supplies the feed-forward.
    """
    links, n = flexible.model.nv, len(flexible.joints)
    size = links + n
    data = flexible.model.createData()
    mass = np.zeros((size, size))
    M = np.triu(pin.crba(flexible.model, data, q))
    mass[:links, :links] = M + np.triu(M, 1).T
    motor = links + np.arange(n)
    mass[motor, motor] = joints.rotor_inertia
    stiffness, damping = springs_and_dampers(flexible, joints, description.drives)
    stiffness[:links, :links] += pin.computeGeneralizedGravityDerivatives(flexible.model, data, q)

    inverse = np.linalg.inv(mass)
    A = np.zeros((2 * size + n, 2 * size + n))
    A[:size, size : 2 * size] = np.eye(size)
    A[size : 2 * size, :size] = -inverse @ stiffness
    A[size : 2 * size, size : 2 * size] = -inverse @ damping
    A[size : 2 * size, 2 * size :] = inverse[:, motor] * joints.integral_gain
    A[2 * size :, motor] = -np.eye(n)
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right)

    chosen = np.flatnonzero(values.imag > 2.0 * np.pi * 0.1)
    chosen = chosen[np.argsort(values[chosen].imag)]
    jacobian = pin.computeFrameJacobian(
        flexible.model, data, q, flexible.flange, pin.LOCAL_WORLD_ALIGNED
    ).reshape(6, -1)[:3]
    drives = description.drives
    rigid = mass[np.ix_(flexible.joints, flexible.joints)]
    windup = np.array(drives.windup_feedforward) / np.array(drives.gear_stiffness)
    friction = np.array(drives.coulomb_friction) / drives.friction_width
    participation = []
    for k in chosen:
        pole = values[k]
        q_r = np.eye(n) + (windup * pole**2)[:, None] * rigid
        torque = pole**2 * (rigid + np.diag(joints.rotor_inertia)) + pole * np.diag(friction)
        push = (joints.velocity_gain * pole + joints.position_gain)[:, None] * q_r + torque
        modal = left[k, size : 2 * size] @ inverse[:, motor] @ push + left[k, 2 * size :] @ q_r
        flange = jacobian @ right[size : size + links, k] * pole
        participation.append(2.0 * np.linalg.norm(np.outer(flange, modal / pole**3)))
    poles = values[chosen]
    return Modes(
        f_d=poles.imag / (2.0 * np.pi),
        zeta=-poles.real / np.abs(poles),
        participation=np.array(participation),
    )

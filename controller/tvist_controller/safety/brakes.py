"""Stop of category 0: power off, and brakes that stop the arm with any torque needed."""

import numpy as np
import pinocchio as pin

from tvist_controller.line.differentiator import Target
from tvist_controller.trajectory import SampledPositions
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, payload_inertia, rigid_model

HOLD = 1.25  # least ratio of a brake's torque to the load by gravity and other joints [-]
LONGEST = 5.0
"""Time after which the arm counts as stopped [s]."""


def brake(description: RobotDescription, carried: Payload, state: Target, period: float) -> SampledPositions:
    """Simulate the rigid arm under its brakes from a state of motion, in ticks of `period` seconds.

    Each joint is slowed down by its brake, assumed as strong as its drive, and stays at rest afterwards. With rotors:

        (M(q) + B) q̈ + C(q, q̇) q̇ + g(q) = -τ_b sgn(q̇)    over the joints that still turn.

    Brakes do not follow a path, so the arm leaves its path.
    """
    model = rigid_model(description, Payload())
    if carried.mass > 0.0:
        flange = model.frames[model.getFrameId(FLANGE)]
        model.inertias[flange.parentJoint] += flange.placement.act(payload_inertia(carried))
    data = model.createData()
    rotor, strength = np.array(description.drives.rotor_inertia), np.array(description.limits.torque)
    q, qd = state.q.copy(), state.qd.copy()
    positions = [q]
    turning = np.abs(qd) > 0.0
    for _ in range(round(LONGEST / period)):
        if not turning.any():
            break
        mass = np.array(pin.crba(model, data, q, pin.Convention.WORLD)) + np.diag(rotor)
        bias = np.array(pin.nonLinearEffects(model, data, q, qd))
        torque = np.maximum(strength, HOLD * np.abs(bias)) * np.sign(qd) + bias
        free = np.flatnonzero(turning)
        new = np.zeros_like(qd)
        new[free] = qd[free] - period * np.linalg.solve(mass[np.ix_(free, free)], torque[free])
        turning &= new * qd > 0.0
        new[~turning] = 0.0
        qd = new
        q = q + period * qd
        positions.append(q)
    return SampledPositions(positions[1:] or positions, period)

"""A payload that changes while the arm moves changes forces, and nothing else at once."""

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import Plant

LIGHT, HEAVY = (
    Payload(mass=mass, com=(0.01, 0.0, 0.1), inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)) for mass in (1.0, 3.0)
)


def held(arm, command, ticks):
    """The measurements of an arm that is held, one a tick."""
    return [arm.step(command) for _ in range(ticks)]


def test_an_arm_settles_as_if_it_had_carried_the_payload_from_the_start(ur5e):
    arm, other = FlexibleArm(ur5e, LIGHT), FlexibleArm(ur5e, HEAVY)
    command = DriveCommand(np.array(ur5e.poses["Q1"]), np.zeros(6), np.zeros(6))
    assert arm.can(Plant.load)
    arm.reset(command)
    before = arm.truth()
    other.reset(command)
    arm.load(HEAVY)
    for name in ("motor_q", "motor_qd", "gear_deflection", "flange_position"):
        np.testing.assert_array_equal(getattr(arm.truth(), name), getattr(before, name))
    np.testing.assert_allclose(held(arm, command, 3000)[-1].q, other.step(command).q, atol=1e-6)
    np.testing.assert_allclose(arm.modes().f_d, other.modes().f_d, rtol=1e-6)
    assert arm.payload == HEAVY

"""MuJoCo, given the same numbers, moves the arm the same way."""

import numpy as np
import pytest

from tvist_plant.description import Payload
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.world.mujoco_arm import MujocoArm

from .arms import chain, hold, quiet
from .reference import commands


def angles(kind, description, drive, **options):
    plant = kind(description, description.payload, **options)
    return np.array([plant.reset(drive[0]).q, *(plant.step(command).q for command in drive[1:])])


def compared(arm, drive):
    """Angles of the arm, and of MuJoCo's with a coarse and a fine step."""
    steps = (0.00025, 0.000125)
    return angles(FlexibleArm, arm, drive), *(angles(MujocoArm, arm, drive, timestep=step) for step in steps)


@pytest.mark.parametrize("kind", ["friction", "clean"])
def test_link_angles_from_Q1_to_Q3_match_mujoco(ur5e, kind, measured):
    """MuJoCo's rule is of first order: half a step off, and right when extrapolated to a step of none."""
    arm = quiet(ur5e) if kind == "friction" else ur5e.clean()
    drive = commands(arm, arm.poses["Q1"], arm.poses["Q3"], 1400)
    ours, coarse, fine = compared(arm, drive)
    difference = np.max(np.abs(coarse - ours))
    extrapolated = np.max(np.abs(2.0 * fine - coarse - ours))
    measured("largest difference at 0.25 ms, extrapolated to 0 [rad]", (difference, extrapolated))
    assert difference < 4e-4  # measured 1.97e-4
    assert np.max(np.abs(fine - ours)) < 0.55 * difference
    assert extrapolated < 1e-6  # measured 3.4e-7


def test_static_equilibrium_matches_mujoco(ur5e):
    arm = ur5e.disturbed_by(["friction"])
    for pose in arm.poses.values():
        command = hold(arm, pose)
        ours = FlexibleArm(arm, arm.payload).reset(command)
        theirs = MujocoArm(arm, arm.payload).reset(command)
        np.testing.assert_allclose(theirs.q, ours.q, rtol=0.0, atol=1e-12)
        for name in ("qd", "moment", "accelerometer"):
            np.testing.assert_allclose(getattr(theirs, name), getattr(ours, name), rtol=0.0, atol=1e-9)


def test_reset_changes_the_payload(ur5e):
    arm, still = MujocoArm(ur5e, ur5e.payload), hold(ur5e, ur5e.poses["Q1"])
    arm.reset(still)
    loaded = arm.truth().gear_deflection[1]
    arm.reset(still, payload=Payload())
    assert arm.payload == Payload()
    assert abs(arm.truth().gear_deflection[1]) < 0.6 * abs(loaded)
    arm.reset(still)
    assert arm.payload == Payload()


@pytest.mark.parametrize("joints", [1, 3, 7])
def test_link_angles_of_other_arms_match_mujoco(joints):
    arm = quiet(chain(joints))
    q = np.linspace(0.3, -0.4, joints)
    drive = commands(arm, q, q + 0.5, 800)
    ours, coarse, fine = compared(arm, drive)
    np.testing.assert_allclose(2.0 * fine - coarse, ours, rtol=0.0, atol=2e-6)

"""The linear part of arm and drives: springs between the right angles, gains at the motors."""

import numpy as np
import pytest

from tvist_plant.drives import LinearPart, Nonlinear
from tvist_plant.model import flexible_model

from .arms import chain


@pytest.fixture
def arm(ur5e):
    return flexible_model(ur5e, ur5e.payload)


def test_matrices_are_symmetric_and_take_energy(ur5e, arm):
    linear = LinearPart.of(arm, ur5e.drives)
    for matrix in (linear.stiffness, linear.damping):
        np.testing.assert_array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix).min() >= -1e-9
    assert linear.stiffness.shape == (16, 16)


def test_turning_the_whole_drive_train_twists_no_gear(ur5e, arm):
    """A joint and its motor turned alike feel the position loop alone."""
    linear = LinearPart.of(arm, ur5e.drives)
    together = np.zeros(16)
    together[arm.joints] = together[10:] = np.arange(1.0, 7.0)
    torque = linear.stiffness @ together
    np.testing.assert_allclose(torque[:10], 0.0, atol=1e-9)
    drives = ur5e.drives
    expected = np.array(drives.velocity_gain) * (np.array(drives.position_gain) + drives.integral_gain)
    np.testing.assert_allclose(torque[10:], expected * np.arange(1.0, 7.0), rtol=1e-12)


def test_a_twisted_gear_pulls_both_ways(ur5e, arm):
    linear = LinearPart.of(arm, ur5e.drives)
    twist = np.zeros(16)
    twist[arm.joints[2]] = 1e-3
    torque = linear.stiffness @ twist
    assert torque[arm.joints[2]] == pytest.approx(32.5)
    assert torque[12] == pytest.approx(-32.5)
    assert np.count_nonzero(torque) == 2


def test_friction_saturates_unless_it_is_taken_as_linear(ur5e):
    assert np.array_equal(Nonlinear.of(ur5e.drives).friction, ur5e.drives.coulomb_friction)
    assert not Nonlinear.of(ur5e.clean().drives).friction.any()


def test_both_kinds_of_friction_have_the_same_slope_at_rest(ur5e, arm):
    real, clean = (LinearPart.of(arm, description.drives) for description in (ur5e, ur5e.clean()))
    np.testing.assert_array_equal(real.damping, clean.damping)
    slope = real.damping[10, 10] - ur5e.drives.gear_damping[0] - ur5e.drives.velocity_gain[0]
    assert slope == pytest.approx(60.0)


def test_sizes_follow_the_arm():
    for joints in (1, 2, 3, 7):
        description = chain(joints)
        flexible = flexible_model(description, description.payload)
        assert LinearPart.of(flexible, description.drives).damping.shape == (2 * joints + 2,) * 2

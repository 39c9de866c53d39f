"""The accelerometer's noise and what it feels at rest."""

import numpy as np
import pytest

from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.sensors import Accelerometer, gear_phases

from .arms import forward_kinematics, hold, quiet


def readings(noise, seed, count=1500):
    sensor = Accelerometer(noise, seed)
    return np.array([sensor.read(np.zeros(3)) for _ in range(count)])


def test_noise_is_that_of_its_seed():
    np.testing.assert_array_equal(readings(0.03, 7), readings(0.03, 7))
    assert not np.any(readings(0.03, 7) == readings(0.03, 8))


def test_noise_is_white_with_the_rms_asked_for():
    noise = readings(0.03, 1, 20000)
    np.testing.assert_allclose(np.sqrt(np.mean(noise**2, axis=0)), 0.03, rtol=0.02)
    np.testing.assert_allclose(np.mean(noise, axis=0), 0.0, atol=4 * 0.03 / np.sqrt(20000))
    correlation = np.corrcoef(np.hstack([noise[:-1], noise[1:]]).T) - np.eye(6)
    assert np.max(np.abs(correlation)) < 0.03


def test_a_quiet_sensor_reads_the_force_itself_in_an_array_of_its_own():
    force = np.array([1.0, 2.0, 3.0])
    reading = Accelerometer(0.0, 0).read(force)
    np.testing.assert_array_equal(reading, force)
    assert reading is not force


def test_gear_phases_are_drawn_by_the_seed_and_not_by_the_noise():
    np.testing.assert_array_equal(gear_phases(6, 1), gear_phases(6, 1))
    assert not np.any(gear_phases(6, 1) == gear_phases(6, 2))
    assert np.all((gear_phases(7, 3) >= 0.0) & (gear_phases(7, 3) < 2 * np.pi))


@pytest.mark.parametrize("case", range(6))
def test_at_rest_it_points_up_with_9_81_in_the_flange_frame(ur5e, case):
    arm = quiet(ur5e)
    q = np.random.default_rng(case).uniform(-np.pi, np.pi, 6)
    plant = FlexibleArm(arm, arm.payload)
    felt = plant.reset(hold(arm, q)).accelerometer
    assert np.linalg.norm(felt) == pytest.approx(9.81, abs=1e-6)
    up = plant.truth().flange_rotation @ felt
    np.testing.assert_allclose(up, [0.0, 0.0, 9.81], atol=1e-6)
    rigid = forward_kinematics(arm, q)[:3, :3]  # the flexible flange leans by some mrad
    np.testing.assert_allclose(rigid @ felt, [0.0, 0.0, 9.81], atol=0.1)

"""The arm as a whole: no drift at rest, equal runs bit for bit, and no non-finite commands."""

import numpy as np
import pytest

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import Plant, PlantError
from tvist_plant.sensors import Accelerometer, gear_phases
from tvist_plant.world.mujoco_arm import MujocoArm

from .arms import changed, forward_kinematics, hold, quiet, rested, standing
from .reference import commands


def fields(record):
    return [np.ravel(getattr(record, name)) for name in record.__dataclass_fields__]


def run(plant, drive, seed=0):
    """Everything measured and true, [ticks, numbers]."""
    rows = [np.concatenate([*fields(plant.reset(drive[0], seed=seed)), *fields(plant.truth())])]
    rows += [np.concatenate([*fields(plant.step(command)), *fields(plant.truth())]) for command in drive[1:]]
    return np.array(rows)


@pytest.fixture(scope="module")
def drive(ur5e):
    return commands(ur5e, ur5e.poses["Q1"], ur5e.poses["Q3"], 1000)


def test_arm_that_holds_still_does_not_drift(ur5e):
    arm = changed(ur5e, "sensors", accelerometer_noise=0.0)
    plant, command, first = standing(arm, arm.poses["Q1"])
    last = rested(plant, command, 5000)
    np.testing.assert_allclose(last.q, first.q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(last.moment, first.moment, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(last.accelerometer, first.accelerometer, rtol=0.0, atol=1e-6)


def test_motors_carry_the_arm_at_rest(ur5e):
    arm = quiet(ur5e)
    plant, command, measured = standing(arm, arm.poses["Q1"])
    assert measured.moment[1] == pytest.approx(command.torque[1], abs=0.2)
    twist = -measured.moment / arm.drives.gear_stiffness
    np.testing.assert_allclose(plant.truth().gear_deflection, twist, atol=1e-8)


def test_integrators_carry_a_wrongly_declared_payload(ur5e):
    """The command feeds forward gravity of 5 kg, the arm carries none: it still starts at rest."""
    plant, command, first = standing(ur5e, ur5e.poses["Q1"], carries=Payload())
    last = rested(plant, command, 500)
    np.testing.assert_allclose(last.q, first.q, rtol=0.0, atol=1e-9)
    assert abs(last.moment[1]) < abs(command.torque[1]) - 40.0


def test_reset_repeats_the_same_run_bit_for_bit(ur5e, drive):
    """To the last bit, also after other motions and payloads."""
    first, plant = run(FlexibleArm(ur5e, ur5e.payload), drive, seed=9), FlexibleArm(ur5e, ur5e.payload)
    run(plant, drive[300:500], seed=1)
    plant.reset(drive[0], payload=Payload(mass=2.0, inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)))
    plant.step(drive[0])
    plant.reset(drive[0], payload=ur5e.payload)
    np.testing.assert_array_equal(run(plant, drive, seed=9), first)


def test_seeds_differ_in_noise_and_gear_error(ur5e, drive):
    plant = FlexibleArm(ur5e, ur5e.payload)
    one, two = run(plant, drive, seed=1), run(plant, drive, seed=2)
    assert np.any(one[-1] != two[-1])
    silent = changed(ur5e, "sensors", accelerometer_noise=0.0)
    plant = FlexibleArm(silent, silent.payload)
    assert np.max(np.abs(run(plant, drive, seed=1)[:, :6] - run(plant, drive, seed=2)[:, :6])) > 1e-6


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
@pytest.mark.parametrize("field", ["q", "qd", "torque"])
def test_non_finite_command_raises_until_a_reset(ur5e, field, bad):
    plant, command, first = standing(ur5e, ur5e.poses["Q1"])
    values = {name: getattr(command, name).copy() for name in ("q", "qd", "torque")}
    values[field][1] = bad
    with pytest.raises(PlantError, match="finite"):  # noqa: PT012 - some ticks pass
        for _ in range(50):
            plant.step(DriveCommand(**values))
    again = plant.reset(command)
    for a, b in zip(fields(first), fields(again), strict=True):
        np.testing.assert_array_equal(a, b)


def test_gear_error_turns_the_link_by_its_amplitude_and_wave(ur5e):
    """Where the arm stands, the links are off by ε sin(n_w θ + φ) against those of a perfect gear."""
    plant = FlexibleArm(ur5e, ur5e.payload)
    perfect = FlexibleArm(quiet(ur5e), ur5e.payload)
    for turn in np.linspace(0.0, 0.05, 7):
        command = hold(ur5e, np.array(ur5e.poses["Q1"]) + turn)
        difference = plant.reset(command, seed=5).q - perfect.reset(command).q
        expected = 2e-5 * np.sin(202 * command.q + gear_phases(6, 5))
        np.testing.assert_allclose(difference, expected, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("kind", [FlexibleArm, MujocoArm])
def test_measurements_are_copies(ur5e, drive, kind):
    plant = kind(ur5e, ur5e.payload)
    measured = plant.reset(drive[0])
    truth = plant.truth()
    before = [part.copy() for part in (*fields(measured), *fields(truth))]
    for command in drive[1:300]:
        plant.step(command)
    for old, now in zip(before, (*fields(measured), *fields(truth)), strict=True):
        np.testing.assert_array_equal(old, now)


def test_accelerometer_noise_is_white_with_the_given_rms():
    sensor = Accelerometer(0.03, 1)
    noise = np.array([sensor.read(np.zeros(3)) for _ in range(20000)])
    np.testing.assert_allclose(np.sqrt(np.mean(noise**2, axis=0)), 0.03, rtol=0.02)
    np.testing.assert_allclose(np.mean(noise, axis=0), 0.0, atol=4 * 0.03 / np.sqrt(20000))
    correlation = np.corrcoef(np.hstack([noise[:-1], noise[1:]]).T) - np.eye(6)
    assert np.max(np.abs(correlation)) < 0.03


@pytest.mark.parametrize("case", range(6))
def test_accelerometer_at_rest_measures_gravity_upwards(ur5e, case):
    arm = quiet(ur5e)
    q = np.random.default_rng(case).uniform(-np.pi, np.pi, 6)
    plant, _, measured = standing(arm, q)
    felt = measured.accelerometer
    assert np.linalg.norm(felt) == pytest.approx(9.81, abs=1e-6)
    up = plant.truth().flange_rotation @ felt
    np.testing.assert_allclose(up, [0.0, 0.0, 9.81], atol=1e-6)
    rigid = forward_kinematics(arm, q)[:3, :3]  # the flexible flange leans by some mrad
    np.testing.assert_allclose(rigid @ felt, [0.0, 0.0, 9.81], atol=0.1)


LIGHT, HEAVY = (
    Payload(mass=mass, com=(0.01, 0.0, 0.1), inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)) for mass in (1.0, 3.0)
)


def test_arm_with_a_changed_payload_settles_as_if_carried_from_the_start(ur5e):
    arm, other = FlexibleArm(ur5e, LIGHT), FlexibleArm(ur5e, HEAVY)
    command = DriveCommand(np.array(ur5e.poses["Q1"]), np.zeros(6), np.zeros(6))
    assert arm.can(Plant.load)
    arm.reset(command)
    before = arm.truth()
    other.reset(command)
    arm.load(HEAVY)
    for name in ("motor_q", "motor_qd", "gear_deflection", "flange_position"):
        np.testing.assert_array_equal(getattr(arm.truth(), name), getattr(before, name))
    np.testing.assert_allclose(rested(arm, command, 3000).q, other.step(command).q, atol=1e-6)
    np.testing.assert_allclose(arm.modes().f_d, other.modes().f_d, rtol=1e-6)
    assert arm.payload == HEAVY

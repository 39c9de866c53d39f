"""The arm as a whole: at rest it rests, equal runs are equal, and what is wrong is said."""

import msgspec
import numpy as np
import pytest

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PlantError
from tvist_plant.sensors import gear_phases

from .arms import changed, hold, quiet
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


def test_a_minute_of_holding_still_moves_nothing(ur5e):
    arm = changed(ur5e, "sensors", accelerometer_noise=0.0)
    plant = FlexibleArm(arm, arm.payload)
    command = hold(arm, arm.poses["Q1"])
    first = plant.reset(command, seed=1)
    for _ in range(30_000):
        last = plant.step(command)
    np.testing.assert_allclose(last.q, first.q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(last.moment, first.moment, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(last.accelerometer, first.accelerometer, rtol=0.0, atol=1e-6)


def test_at_rest_the_motors_carry_the_arm(ur5e):
    arm = quiet(ur5e)
    plant = FlexibleArm(arm, arm.payload)
    command = hold(arm, arm.poses["Q1"])
    measured = plant.reset(command)
    assert measured.moment[1] == pytest.approx(command.torque[1], abs=0.2)
    twist = -measured.moment / arm.drives.gear_stiffness
    np.testing.assert_allclose(plant.truth().gear_deflection, twist, atol=1e-8)


def test_a_wrong_declared_payload_is_carried_by_the_integrators(ur5e):
    """The command feeds forward gravity of 5 kg, the arm carries none: it still starts at rest."""
    plant = FlexibleArm(ur5e, ur5e.payload)
    command = hold(ur5e, ur5e.poses["Q1"])
    first = plant.reset(command, payload=Payload())
    for _ in range(500):
        last = plant.step(command)
    np.testing.assert_allclose(last.q, first.q, rtol=0.0, atol=1e-9)
    assert abs(last.moment[1]) < abs(command.torque[1]) - 40.0


def test_equal_runs_are_equal_to_the_last_bit(ur5e, drive):
    first, second = (run(FlexibleArm(ur5e, ur5e.payload), drive, seed=9) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_reset_starts_the_same_run_again(ur5e, drive):
    plant = FlexibleArm(ur5e, ur5e.payload)
    first = run(plant, drive, seed=9)
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


def test_without_noise_and_gear_error_the_seed_means_nothing(ur5e, drive):
    arm = quiet(ur5e)
    plant = FlexibleArm(arm, arm.payload)
    np.testing.assert_array_equal(run(plant, drive[:200], seed=1), run(plant, drive[:200], seed=2))


def test_a_lighter_payload_twists_the_gears_less(ur5e):
    plant = FlexibleArm(ur5e, ur5e.payload)
    command = hold(ur5e, ur5e.poses["Q1"])
    plant.reset(command)
    loaded = plant.truth()
    plant.reset(command, payload=Payload())
    assert plant.payload == Payload()
    assert abs(plant.truth().gear_deflection[1]) < 0.6 * abs(loaded.gear_deflection[1])
    assert np.all(np.abs(plant.truth().link_deflection) <= np.abs(loaded.link_deflection))
    plant.reset(command)
    assert plant.payload == Payload()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
@pytest.mark.parametrize("field", ["q", "qd", "torque"])
def test_a_command_without_sense_raises_and_a_reset_heals(ur5e, field, bad):
    plant = FlexibleArm(ur5e, ur5e.payload)
    command = hold(ur5e, ur5e.poses["Q1"])
    first = plant.reset(command)
    values = {name: getattr(command, name).copy() for name in ("q", "qd", "torque")}
    values[field][1] = bad
    with pytest.raises(PlantError, match="finite"):  # noqa: PT012 - some ticks pass
        for _ in range(50):
            plant.step(DriveCommand(**values))
    again = plant.reset(command)
    for a, b in zip(fields(first), fields(again), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_gear_error_turns_the_link_by_its_amplitude_and_wave(ur5e):
    """Where the arm stands, the links are off by ε sin(n_w θ + φ) against those of a perfect gear."""
    plant = FlexibleArm(ur5e, ur5e.payload)
    perfect = FlexibleArm(quiet(ur5e), ur5e.payload)
    for turn in np.linspace(0.0, 0.05, 7):
        command = hold(ur5e, np.array(ur5e.poses["Q1"]) + turn)
        difference = plant.reset(command, seed=5).q - perfect.reset(command).q
        expected = 2e-5 * np.sin(202 * command.q + gear_phases(6, 5))
        np.testing.assert_allclose(difference, expected, rtol=0.0, atol=1e-8)


def test_a_gear_error_ripples_while_the_joint_turns(ur5e):
    """At a steady speed the deviation has 202 waves a turn."""
    arm = changed(ur5e, "sensors", accelerometer_noise=0.0)
    speed, ticks = 0.3, 4000
    rows = []
    for description in (arm, quiet(ur5e)):
        only_base = changed(description, "drives", windup_feedforward=(0.0,) * 6)
        plant = FlexibleArm(only_base, arm.payload)
        start = hold(arm, arm.poses["Q1"])
        plant.reset(start)
        drive = []
        for tick in range(ticks):
            along = np.eye(6)[0] * speed
            drive.append(DriveCommand(start.q + along * 0.002 * tick, along, start.torque))
        rows.append(np.array([plant.step(command).q[0] for command in drive]))
    ripple = (rows[0] - rows[1])[1000:]
    spectrum = np.abs(np.fft.rfft(ripple * np.hanning(len(ripple))))[5:]
    peak = np.fft.rfftfreq(len(ripple), 0.002)[5:][np.argmax(spectrum)]
    assert peak == pytest.approx(202 * speed / (2 * np.pi), abs=0.3)


def test_measurements_are_copies(ur5e, drive):
    plant = FlexibleArm(ur5e, ur5e.payload)
    measured = plant.reset(drive[0])
    truth = plant.truth()
    before = [part.copy() for part in (*fields(measured), *fields(truth))]
    for command in drive[1:300]:
        plant.step(command)
    for old, now in zip(before, (*fields(measured), *fields(truth)), strict=True):
        np.testing.assert_array_equal(old, now)


def test_the_rotors_and_all_links_follow_the_reference(ur5e):
    """After the move and its ring-down the motors stand at the target, the links hang by their weight."""
    arm = quiet(ur5e)
    plant = FlexibleArm(arm, arm.payload)
    target = hold(arm, arm.poses["Q3"])
    drive = [*commands(arm, arm.poses["Q1"], arm.poses["Q3"], 1400), *[target] * 3000]
    plant.reset(drive[0])
    for command in drive[1:]:
        plant.step(command)
    rest = FlexibleArm(arm, arm.payload).reset(target)
    np.testing.assert_allclose(plant.truth().motor_q, target.q, rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(plant._q[plant._flexible.joints], rest.q, rtol=0.0, atol=2e-6)


def test_numbers_of_the_description_are_not_changed_by_a_run(ur5e, drive):
    before = msgspec.json.encode(ur5e)
    run(FlexibleArm(ur5e, ur5e.payload), drive[:50])
    assert msgspec.json.encode(ur5e) == before

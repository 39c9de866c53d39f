"""Springs and drives from a few ring-downs, as a client; and what is said where they do not do."""

import asyncio
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from tvist_controller.api.line import MotionLimits
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.calibrations import modal_estimator
from tvist_lab.identification.calibrate import calibrate, true_errors
from tvist_lab.identification.design import choose, free_configurations, jog_of, predicted
from tvist_lab.identification.forecast import SIGNIFICANT
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.identification.modal_fit import describe, fit_from_many, information, own_poles
from tvist_lab.identification.ring_downs import IdentificationError
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load
from tvist_protocol.calibration import calibration_from_json, calibration_to_json

ROBOT = load("ur5e")
PAYLOADS = (paper_payload(ROBOT, 0.0), paper_payload(ROBOT, 5.0))
FEWER = {
    "jogs.CANDIDATES": 12,
    "jogs.CANDIDATES_PER_JOG": 2,
    "jogs.WAYS": MotionLimits(velocity=3.0, acceleration=8.0, jerk=500.0),
    "calibrate.CANDIDATES": 10,
    "calibrate.PLACES": 5,
    "calibrate.UNSEEN": 20,
    "calibrate.WORKSPACE": 20,
    "friction.LENGTH": 0.2,
    "friction.ROUNDS": 2,
    "modal_fit.SOFTENINGS": (0.0, 100.0),
    "modal_fit.STARTS": 2,
    "forecast.SINGLY": 0,
    "forecast.FOLDS": 2,
}
"""Constants of an identification with fewer choices and fits than usual, and quicker ways."""


def recorded(ring_downs, seed, payloads=PAYLOADS, description=ROBOT):
    async def run():
        setup = replace(free_setup(calibration="none", seed=seed, truth=False), description=ROBOT)
        async with robot_in_process(setup) as robot, robot.control("test") as arm:
            plan = await plan_jogs(robot, description, ring_downs, payloads=payloads, seed=seed)
            return await make_jogs(robot, arm, plan, lambda _: None)

    return asyncio.run(run())


def identified(jogs):
    return calibrate(ROBOT, jogs, name="test", command="a test", progress=lambda _: None)


@pytest.fixture(scope="module")
def _fewer():
    with pytest.MonkeyPatch.context() as fewer:
        for name, value in FEWER.items():
            fewer.setattr(f"tvist_lab.identification.{name}", value)
        yield


@pytest.fixture(scope="module")
def jogs(_fewer):
    return recorded(5, seed=11)


@pytest.fixture(scope="module")
def done(jogs):
    return identified(jogs)


@pytest.fixture(scope="module")
def synthetic(_fewer):
    """Ring-downs of the arm as guessed, with the noise of the accelerometer."""
    arm = ArmModes(ROBOT, PAYLOADS)
    candidates = free_configurations(ROBOT, PAYLOADS, 16, 5)
    rng = np.random.default_rng(6)
    rings = []
    for number, q in enumerate(candidates[:5]):
        ring = predicted(arm, q, number % 2)
        rings.append(replace(ring, force=ring.force + rng.normal(0.0, ring.noise, ring.force.shape)))
    return arm, candidates, rings


def test_jogs_with_each_payload_in_turn_are_recorded(jogs):
    assert [log.payload.mass for log in jogs.logs] == [0.0] * 3 + [5.0] * 2
    assert jogs.no_friction == ""


def test_five_ring_downs_predict_modes_at_new_poses_and_payloads(done):
    first, second, third = true_errors(ROBOT, done.calibration, PAYLOADS, 11)
    assert first.f_d.median < 3.0
    assert second.f_d.median < 4.0
    assert third.f_d.median < 4.0
    assert first.zeta.median < 10.0


def test_calibration_has_errors_and_origin(done):
    calibration, model = done.calibration, done.calibration.modal
    assert calibration.robot == ROBOT.robot.model
    assert calibration.provenance.ring_downs == len(model.ring_downs) == 5
    assert [payload.mass for payload in model.payloads] == [0.0, 5.0]
    assert [ring.payload for ring in model.ring_downs].count(0) == 3
    assert 0.8 < model.residual_to_noise < 1.3
    status = {(p.quantity, p.joints): p for p in model.parameters}
    shoulder = status["gear_stiffness", (1,)]
    assert shoulder.status == "identified"
    assert shoulder.interval[0] < shoulder.value < shoulder.interval[1]
    # five standard deviations, since what the model leaves out is not in them
    assert abs(np.log(shoulder.value / 32_500.0)) < 5.0 * shoulder.deviation
    rotor = status["rotor_inertia", (1,)]
    assert rotor.status == "not identifiable"
    assert rotor.interval[0] < 1.2 < rotor.interval[1]
    assert calibration_from_json(calibration_to_json(calibration)) == calibration
    rng = np.random.default_rng(1)
    for _ in range(20):
        payload = paper_payload(ROBOT, float(rng.uniform(0.0, 5.0)))
        estimator = modal_estimator(calibration, ROBOT, payload)
        estimator.estimate(rng.uniform(-np.pi, np.pi, 6))
        assert not estimator.clipped


@pytest.mark.nightly
@pytest.mark.usefixtures("_fewer")
def test_one_payload_suffices_for_that_payload():
    found = identified(recorded(6, seed=3, payloads=()))
    assert [payload.mass for payload in found.calibration.modal.payloads] == [5.0]
    assert found.calibration.modal.cross_validated_f_d_percent[0].median < 5.0


def test_file_of_another_robot_is_refused():
    other = msgspec.structs.replace(ROBOT, robot=msgspec.structs.replace(ROBOT.robot, model="other"))
    with pytest.raises(IdentificationError, match="is a UR5e"):
        recorded(4, seed=0, description=other)


def test_parameters_are_found_from_noisy_ring_downs(synthetic):
    arm, _, rings = synthetic
    fit = fit_from_many(arm, rings)
    assert np.all(np.abs(fit.logarithms - arm.guess) < 5.0 * fit.deviations)
    np.testing.assert_allclose(fit.residual_to_noise, 1.0, atol=0.15)
    for ring in rings:
        mass = arm.mass(ring.q, ring.payload)
        found, _ = describe(fit.drivetrain.poles(mass)[0][:2])
        true, _ = describe(arm.drivetrain(arm.guess).poles(mass)[0][:2])
        np.testing.assert_allclose(found, true, rtol=0.03)


def test_free_poles_explain_only_noise_beyond_the_model(synthetic):
    arm, _, rings = synthetic
    for ring in rings:
        poles = arm.drivetrain(arm.guess).poles(arm.mass(ring.q, ring.payload))[0][:4]
        right = own_poles(arm, ring, poles)
        assert right.significance < SIGNIFICANT
        swapped = arm.drivetrain(arm.guess).poles(arm.mass(ring.q, 1 - ring.payload))[0][:4]
        assert own_poles(arm, ring, swapped).significance > right.significance


def test_chosen_poses_are_distinct_and_more_informative(synthetic):
    arm, candidates, _ = synthetic
    chosen = choose(arm, candidates, (3, 3))
    assert len(set(chosen)) == 6
    assert [payload for _, payload in chosen].count(0) == 3

    def knowledge(keys):
        says = [information(arm, predicted(arm, candidates[n], p), arm.guess) for n, p in keys]
        return np.linalg.slogdet(np.diag(arm.deviation**-2) + sum(says))[1]

    assert knowledge(chosen) > knowledge([(n, p) for n in range(3) for p in range(2)])


def test_jogs_are_free_of_collisions_at_both_ends():
    model = CollisionModel(ROBOT, body(PAYLOADS[1]))
    for q in free_configurations(ROBOT, PAYLOADS, 20, 2):
        assert model.meeting(q) is model.meeting(q - jog_of(6)) is None


def test_parameters_without_information_are_not_identifiable(synthetic):
    arm, _, rings = synthetic
    fit = fit_from_many(arm, rings[:1])
    parameters = arm.parameters(fit.logarithms, fit.deviations)
    assert [one.status for one in parameters].count("not identifiable") >= 4
    assert all(one.interval[0] <= one.value <= one.interval[1] for one in parameters)

"""A calibration of springs and drives, and the estimator that is made of it."""

import msgspec
import numpy as np
import pytest

from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.calibrations import available, estimator_of, fits, load, modal_estimator
from tvist_plant.description import load as load_robot
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.calibration import (
    CalibrationError,
    calibration_from_json,
    calibration_of,
    calibration_to_json,
)
from tvist_protocol.errors import ProtocolError
from tvist_shaping.errors import EstimatorError

ROBOT = load_robot("ur5e")
REPLACE = msgspec.structs.replace


@pytest.fixture(scope="module")
def calibration():
    return load("ur5e_modal")


def test_one_ships_and_says_how_it_was_made(calibration):
    assert "ur5e_modal" in available()
    assert calibration.provenance.command.startswith("tvist identify --model modal --ring-downs 12")
    assert calibration.provenance.ring_downs == 12
    assert calibration_from_json(calibration_to_json(calibration)) == calibration


def test_it_is_near_the_true_modes_with_any_payload(calibration):
    """By chance a dozen noisy ring-downs may do worse; this is the file that ships."""
    rng = np.random.default_rng(2025)
    off = []
    for _ in range(60):
        q = rng.uniform([-np.pi, -np.pi, -2.6, -np.pi, 0, 0], [np.pi, 0, 2.6, 0, 0, 0])
        payload = paper_payload(ROBOT, float(rng.uniform(0.0, 5.0)))
        true = FlexibleArm(ROBOT, body(payload)).modes(q)
        f_d, zeta = modal_estimator(calibration, ROBOT, payload, 3).estimate(q)
        off.append((np.abs(f_d / true.f_d[:3] - 1.0), np.abs(zeta / true.zeta[:3] - 1.0)))
    f_d, zeta = np.median(off, axis=0)
    assert (f_d < 0.02).all()
    assert (zeta[:2] < 0.06).all()
    assert zeta[2] < 0.25


def test_it_holds_for_any_payload_and_polynomials_for_their_own(calibration):
    for mass in (0.0, 2.0, 5.0):
        assert fits(calibration, paper_payload(ROBOT, mass))
    both = REPLACE(calibration, polynomial=load("ur5e_5kg").polynomial)
    light = paper_payload(ROBOT, 2.0)
    assert fits(both, light, "modal")
    assert not fits(both, light, "polynomial")


def test_a_calibration_of_another_arm_is_refused(calibration):
    with pytest.raises(EstimatorError, match="'UR5e', which this arm is"):
        modal_estimator(REPLACE(calibration, robot="UR10e"), ROBOT, paper_payload(ROBOT))


def test_one_without_the_model_asked_for_is_refused(calibration):
    with pytest.raises(EstimatorError, match="tvist identify"):
        modal_estimator(load("ur5e_5kg"), ROBOT, paper_payload(ROBOT))
    with pytest.raises(EstimatorError, match="polynomial"):
        estimator_of(calibration)


def without(parameters, quantity):
    return tuple(parameter for parameter in parameters if parameter.quantity != quantity)


@pytest.mark.parametrize("quantity", ["gear_stiffness", "damping_time", "bending_stiffness"])
def test_a_parameter_that_is_missing_or_said_twice_is_refused_by_name(calibration, quantity):
    model = calibration.modal
    for parameters in (
        without(model.parameters, quantity),
        (*model.parameters, next(p for p in model.parameters if p.quantity == quantity)),
    ):
        wrong = REPLACE(calibration, modal=REPLACE(model, parameters=parameters))
        with pytest.raises(EstimatorError, match=f"{quantity} of joints"):
            modal_estimator(wrong, ROBOT, paper_payload(ROBOT))


def test_a_calibration_without_any_model_is_refused():
    content = msgspec.to_builtins(load("ur5e_5kg"))
    del content["polynomial"]
    with pytest.raises(ProtocolError, match="polynomial and modal are both missing"):
        calibration_of(content)
    with pytest.raises(CalibrationError, match="polynomial and modal are both missing"):
        calibration_from_json(msgspec.json.encode(content))


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"value": -1.0}, "calibration.modal.parameters[0].value"),
        ({"quantity": "colour"}, "calibration.modal.parameters[0].quantity"),
        ({"colour": 1}, "calibration.modal.parameters[0].colour"),
    ],
)
def test_a_fault_deep_in_it_is_named_where_it_is(calibration, change, where):
    content = msgspec.to_builtins(calibration)
    content["modal"]["parameters"] = [dict(p) for p in content["modal"]["parameters"]]
    content["modal"]["parameters"][0] |= change
    with pytest.raises(ProtocolError) as error:
        calibration_of(content)
    assert error.value.where == where

"""The calibration of a robot under test: its own of the package, or one made of the springs and drives in its file."""

from collections.abc import Sequence

import msgspec
import numpy as np

from tvist_controller.api.line import (
    body,
    calibrations,
    default_calibration,
    drivetrain,
    load_calibration,
    paper_payload,
)
from tvist_lab.identification.modal_calibration import mode_range
from tvist_plant.description import RobotDescription
from tvist_plant.model import flexible_model
from tvist_protocol.calibration import Calibration, ModalParameter, Quantity

_OF_DRIVES: tuple[Quantity, ...] = ("gear_stiffness", "rotor_inertia", "velocity_gain", "position_gain")
_made: dict[str, Calibration] = {}


def own_calibration(arm: RobotDescription) -> Calibration:
    """Return the calibration that `tvist serve` uses, or if none is modal what a perfect identification would find."""
    model = arm.robot.model
    if any(one.robot == model and one.modal is not None for one in map(load_calibration, calibrations())):
        return load_calibration(str(default_calibration(model)))
    if model not in _made:
        _made[model] = _of_its_file(arm)
    return _made[model]


def _of_its_file(arm: RobotDescription) -> Calibration:
    drives, joints, replace = arm.drives, range(arm.joints), msgspec.structs.replace
    rows: list[tuple[Quantity, Sequence[float], Sequence[int]]] = [
        *((name, getattr(drives, name), joints) for name in _OF_DRIVES),
        ("damping_time", np.divide(drives.gear_damping, drives.gear_stiffness).tolist(), joints),
        ("bending_stiffness", arm.link_flexibility.stiffness, arm.link_flexibility.links),
    ]
    parameters = tuple(
        ModalParameter(
            quantity=name, joints=(at,), value=value, deviation=0.0, interval=(value, value), status="assumed"
        )
        for name, values, places in rows
        for at, value in zip(places, values, strict=True)
    )
    springs = drivetrain(parameters, arm, flexible_model(arm, body(paper_payload(arm))))
    f_d_min, zeta_max = mode_range(arm, springs)
    pattern = load_calibration("ur5e_modal")  # for the rest, such as ring-downs
    assert pattern.modal is not None
    modal = replace(pattern.modal, parameters=parameters, f_d_min=f_d_min, zeta_max=zeta_max)
    own = replace(pattern.provenance, arm=None)
    return replace(pattern, name="assumed", robot=arm.robot.model, modal=modal, provenance=own)

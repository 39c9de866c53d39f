"""Calibrations of the package, and their products: estimators, elastic feed-forward, friction."""

from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import pinocchio as pin
from msgspec import structs

from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.joint_controllers import described_friction
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import FlexibleModel, Floats, flexible_model
from tvist_plant.user_file import UserFileError, read_bytes
from tvist_protocol.calibration import (
    Calibration,
    CalibrationError,
    ModalModel,
    ModalParameter,
    Quantity,
    calibration_from_json,
)
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal
from tvist_shaping.estimators.polynomial import Polynomial
from tvist_shaping.filter import TvistFilter

_FILES = resources.files(__package__)
FRICTION: tuple[Quantity, ...] = (
    "coulomb_friction", "breakaway", "stribeck_speed", "friction_width", "viscous_friction",
)  # fmt: skip
"""Quantities of a joint's friction, in the order of `friction_law`."""
MOTORS: tuple[Quantity, ...] = ("rotor_inertia", "velocity_gain", "position_gain")
"""Quantities of a joint's motor, in the order of `Drivetrain`."""
MODES = 4  # default number of estimated modes


def available() -> tuple[str, ...]:
    """Return the names of the calibrations that come with the package."""
    return tuple(
        sorted(file.name.removesuffix(".json") for file in _FILES.iterdir() if file.name.endswith(".json"))
    )


@cache
def default_for(model: str) -> str | None:
    """Return the default calibration of a robot model, None without one.

    This is the first by name with the paper's polynomials for this model, else the first for this model.
    """
    own = [name for name in available() if load(name).robot == model]
    return next((name for name in own if load(name).polynomial is not None), own[0] if own else None)


def load(calibration: str | Path) -> Calibration:
    """Read and check a calibration.

    Args:
        calibration: Name of a calibration of the package, or path of a file.

    Raises:
        CalibrationError: It does not exist or is invalid; the message names file and key.
        UserFileError: The file is not text, too large or nested too deeply.
    """
    try:
        if isinstance(calibration, str) and calibration in available():
            content = (_FILES / f"{calibration}.json").read_bytes()
        else:
            content = read_bytes(calibration, "calibration")
        return calibration_from_json(content)
    except RecursionError:
        raise UserFileError(f"calibration {calibration} is nested too deeply") from None
    except OSError as error:
        known = ", ".join(available())
        raise CalibrationError(
            f"calibration {str(calibration)!r}: must be one of {known} or a readable file ({error.strerror})"
        ) from error
    except CalibrationError as error:
        raise CalibrationError(f"calibration {calibration}: {error}") from error


def estimator_of(calibration: Calibration) -> Polynomial:
    """Return the paper's estimator with a calibration's polynomials."""
    if calibration.polynomial is None:
        raise EstimatorError("polynomial", None, "there; this calibration is for the estimator modal alone")
    given = structs.asdict(calibration.polynomial)
    return Polynomial(**{key: value for key, value in given.items() if key not in {"basis", "scale"}})


def fits(calibration: Calibration, payload: Payload, estimator: str = "polynomial") -> bool:
    """Return whether a calibration is valid for a payload.

    A modal model is valid for any payload; polynomials only within 2 % of their payload's mass and 10 mm of
    its centre.
    """
    if estimator == "modal" or calibration.polynomial is None:
        return True
    made_with = calibration.payload
    if abs(payload.mass - made_with.mass) > 0.02 * max(made_with.mass, 1.0):
        return False
    if made_with.mass == 0.0:
        return True
    return max(abs(a - b) for a, b in zip(payload.com, made_with.com, strict=True)) <= 0.01


def modal_estimator(
    calibration: Calibration, description: RobotDescription, payload: Payload, modes: int = MODES
) -> Modal:
    """Return an estimator of the arm's lowest modes without using springs and drives of the robot file.

    It takes less than a millisecond, so a payload can be declared between two ticks.
    """
    known = _modal(calibration, description)
    flexible = flexible_model(description, Body(mass=payload.mass, com=payload.com, inertia=payload.inertia))
    return Modal(
        mass_matrix(flexible),
        drivetrain(known.parameters, description, flexible),
        modes=modes,
        f_d_min=known.f_d_min,
        zeta_max=known.zeta_max,
    )


def elastic_feed_forward(
    tvist: Filter, description: RobotDescription, calibration: Calibration
) -> ElasticFeedForward | None:
    """Create a filter's elastic feed-forward from a calibration's springs; None if the filter uses none."""
    if tvist.feed_forward == "rigid":
        return None
    parameters = _modal(calibration, description).parameters
    springs = drivetrain(parameters, description, flexible_model(description, Body()))
    stiffness = np.array(springs.stiffness)
    return ElasticFeedForward(
        description,
        stiffness,
        np.array(springs.damping) / stiffness,
        tvist.period,
        torques=tvist.feed_forward == "elastic",
        law=known_friction(tvist, description, calibration),
    )


def known_friction(
    tvist: Filter | None, description: RobotDescription, calibration: Calibration | None
) -> Floats | None:
    """Return friction to feed forward in full, see `LAWS`; None for a fraction of Coulomb friction.

    This is the friction of the robot file, if that contains stiction, else the identified friction. Without
    shaping (`tvist` None) and with the paper's filter, the robot file's is not used: the paper's controller
    fed only a fraction of Coulomb friction forward, to which the tails of its Table 2 are due.
    """
    plain = tvist is None or isinstance(tvist, TvistFilter)
    described = None if plain else described_friction(description)
    if described is not None or calibration is None or calibration.modal is None:
        return described
    return friction_law(calibration.modal.parameters, description)


def _modal(calibration: Calibration, description: RobotDescription) -> ModalModel:
    """Return a calibration's modal model; EstimatorError if it is missing or belongs to another robot."""
    if calibration.modal is None:
        wanted = "a model that tvist identify makes; this calibration has polynomials alone"
        raise EstimatorError("modal", None, wanted)
    if calibration.robot != description.robot.model:
        raise EstimatorError("robot", calibration.robot, f"{description.robot.model!r}, which this arm is")
    return calibration.modal


def mass_matrix(flexible: FlexibleModel) -> Callable[[Floats], Floats]:
    """Return M(q) of the arm with unbent links, in coordinates of joints and bending, shape (L, L)."""
    data, coordinates = flexible.model.createData(), np.zeros(flexible.model.nv)

    def at(q: Floats) -> Floats:
        coordinates[flexible.joints] = q
        return np.asarray(pin.crba(flexible.model, data, coordinates, pin.Convention.WORLD))

    return at


def drivetrain(
    parameters: Sequence[ModalParameter], description: RobotDescription, flexible: FlexibleModel
) -> Drivetrain:
    """Return springs and drives in the order of the mass matrix."""
    size = flexible.model.nv
    links, joints = description.link_flexibility.links, range(description.joints)
    stiffness = np.zeros(size)
    stiffness[flexible.joints] = _values(parameters, "gear_stiffness", joints)
    # Each link has two coordinates, about its y and z axes.
    stiffness[flexible.flexes] = np.repeat(_values(parameters, "bending_stiffness", links), 2)
    motors = np.zeros((3, size))
    for row, quantity in zip(motors, MOTORS, strict=True):
        row[flexible.joints] = _values(parameters, quantity, joints)
    times = _values(parameters, "damping_time", joints)
    damping = stiffness.copy()
    damping[flexible.joints] *= times
    damping[flexible.flexes] *= np.repeat([times[link] for link in links], 2)
    return Drivetrain(*(tuple(row.tolist()) for row in (stiffness, *motors, damping)))


def friction_law(parameters: Sequence[ModalParameter], description: RobotDescription) -> Floats | None:
    """Return each joint's friction, rows F_c, F_s/F_c, v_s, w, F_v, shape (5, n); None if unknown."""
    if all(parameter.quantity not in FRICTION for parameter in parameters):
        return None
    law = np.array([_values(parameters, quantity, range(description.joints)) for quantity in FRICTION])
    most = law[0] * np.maximum(law[1], 1.0) + law[4] * np.array(description.limits.velocity)
    for joint, (torque, limit) in enumerate(zip(most.tolist(), description.limits.torque, strict=True)):
        if torque > limit:
            at_most = (
                f"at most the {limit:g} N m of its drive, with breakaway and viscous_friction at full speed"
            )
            raise EstimatorError(f"coulomb_friction of joint {joint}", round(torque, 3), at_most)
    return law


def _values(
    parameters: Sequence[ModalParameter], quantity: Quantity, places: range | tuple[int, ...]
) -> list[float]:
    said = [(j, one.value) for one in parameters if one.quantity == quantity for j in one.joints]
    numbers = sorted(place for place, _ in said)
    if numbers != sorted(places):
        raise EstimatorError(f"{quantity} of joints", numbers, f"said once for each of {sorted(places)}")
    values = dict(said)
    return [values[place] for place in places]

"""Modes of an arm, computed from its masses, the declared payload and a calibration's springs and drives."""

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin

from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import FlexibleModel, Floats, flexible_model
from tvist_protocol.calibration import Calibration, ModalModel, ModalParameter, Quantity
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal

FRICTION: tuple[Quantity, ...] = (
    "coulomb_friction", "breakaway", "stribeck_speed", "friction_width", "viscous_friction",
)  # fmt: skip
"""Quantities of a joint's friction, in the order of `friction_law`."""
MODES = 4
"""Default number of estimated modes."""


def modal_estimator(
    calibration: Calibration, description: RobotDescription, payload: Payload, modes: int = MODES
) -> Modal:
    """Return an estimator of the arm's lowest modes; it uses no springs or drives of the robot file.

    This takes less than a millisecond, so a payload can be declared between two ticks.
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
    """Create the elastic feed-forward that a filter needs, with a calibration's springs; None if it does without."""
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
        law=friction_law(parameters, description),
    )


def _modal(calibration: Calibration, description: RobotDescription) -> ModalModel:
    """Return the modal model of a calibration of this arm."""
    if calibration.modal is None:
        wanted = "a model with tvist identify --model modal; this calibration has polynomials alone"
        raise EstimatorError("modal", None, wanted)
    if calibration.robot != description.robot.model:
        raise EstimatorError("robot", calibration.robot, f"{description.robot.model!r}, which this arm is")
    return calibration.modal


def mass_matrix(flexible: FlexibleModel) -> Callable[[Floats], Floats]:
    """M(q) of the arm with unbent links, in the coordinates of its joints and its bending, shape (L, L)."""
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
    for row, quantity in zip(motors, ("rotor_inertia", "velocity_gain", "position_gain"), strict=True):
        row[flexible.joints] = _values(parameters, quantity, joints)
    times = _values(parameters, "damping_time", joints)
    damping = stiffness.copy()
    damping[flexible.joints] *= times
    damping[flexible.flexes] *= np.repeat([times[link] for link in links], 2)
    return Drivetrain(*(tuple(row.tolist()) for row in (stiffness, *motors, damping)))


def friction_law(parameters: Sequence[ModalParameter], description: RobotDescription) -> Floats | None:
    """Return the friction of each joint, rows F_c, F_s/F_c, v_s, w and F_v, shape (5, n); None if it is not known."""
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
    """Return a quantity of each joint or link."""
    said = [(j, one.value) for one in parameters if one.quantity == quantity for j in one.joints]
    numbers = sorted(place for place, _ in said)
    if numbers != sorted(places):
        raise EstimatorError(f"{quantity} of joints", numbers, f"said once for each of {sorted(places)}")
    values = dict(said)
    return [values[place] for place in places]

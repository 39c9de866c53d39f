"""Elastic feed-forward for a filter, with the springs of a calibration."""

import numpy as np

from tvist_controller.calibrations.modal import drivetrain, friction_law
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.joint_controllers import described_friction
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import Floats, flexible_model
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter
from tvist_shaping.errors import EstimatorError
from tvist_shaping.filter import TvistFilter


def elastic_feed_forward(
    tvist: Filter, description: RobotDescription, calibration: Calibration
) -> ElasticFeedForward | None:
    """Create the elastic feed-forward that a filter needs; None if it does without.

    Raises:
        EstimatorError: The calibration has no modal model, belongs to another arm, or lacks a parameter.
    """
    if tvist.feed_forward == "rigid":
        return None
    springs = springs_of(description, calibration)
    law = known_friction(tvist, description, calibration)
    torques = tvist.feed_forward == "elastic"
    return ElasticFeedForward(description, *springs, tvist.period, torques=torques, law=law)


def known_friction(
    tvist: Filter | None, description: RobotDescription, calibration: Calibration | None
) -> Floats | None:
    """Return the friction that is fed forward in full with a filter, see `LAWS`; None for a share of Coulomb friction.

    If the robot file says how the motors stick, it is that of the file. Unshaped, for which the filter is None, and
    with the paper's filter it is not, since the tails of Table 2 are what a share of Coulomb friction leaves.
    Otherwise it is what was identified.

    Raises:
        EstimatorError: See `friction_law`.
    """
    plain = tvist is None or isinstance(tvist, TvistFilter)
    described = None if plain else described_friction(description)
    if described is not None or calibration is None or calibration.modal is None:
        return described
    return friction_law(calibration.modal.parameters, description)


def springs_of(description: RobotDescription, calibration: Calibration) -> tuple[Floats, Floats]:
    """Return stiffness [N m/rad] and damping time [s] of gears and bending links, each of shape (N,).

    They are those of a calibration; springs and gains in the robot file are not used.

    Raises:
        EstimatorError: See `elastic_feed_forward`.
    """
    if calibration.modal is None:
        wanted = "a model with tvist identify --model modal; this calibration has polynomials alone"
        raise EstimatorError("modal", None, wanted)
    if calibration.robot != description.robot.model:
        raise EstimatorError("robot", calibration.robot, f"{description.robot.model!r}, which this arm is")
    springs = drivetrain(calibration.modal.parameters, description, flexible_model(description, Payload()))
    stiffness = np.array(springs.stiffness)
    return stiffness, np.array(springs.damping) / stiffness

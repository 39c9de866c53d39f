"""Elastic feed-forward for a filter, with the springs of a calibration."""

import numpy as np

from tvist_controller.calibrations.modal import drivetrain, friction_law
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import Floats, flexible_model
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter
from tvist_shaping.errors import EstimatorError


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
    law = friction_law(calibration.modal.parameters, description) if calibration.modal is not None else None
    torques = tvist.feed_forward == "elastic"
    return ElasticFeedForward(description, *springs, tvist.period, torques=torques, law=law)


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

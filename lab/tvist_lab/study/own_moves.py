"""Moves as the robot makes them: planned for the filter that shapes them."""

import numpy as np
from msgspec.structs import replace

from tvist_controller.api.line import (
    ElasticArm,
    JointLine,
    MotionLimits,
    keeping_motion,
    paper_payload,
    quiet_motion,
)
from tvist_lab.recordings import Floats
from tvist_lab.study.line import samples_of
from tvist_lab.study.moves import Move
from tvist_lab.study.recipes import Recipe, RecipeError
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration, ModalParameter
from tvist_shaping.base import Filter
from tvist_shaping.named import PLANNED

_POWERS = {
    "gear_stiffness": 2,
    "bending_stiffness": 2,
    "velocity_gain": 1,
    "position_gain": 1,
    "damping_time": -1,
}
"""Powers of frequency by which the parameters of an arm change if all its frequencies change alike."""


def own_move(
    recipe: Recipe, description: RobotDescription, move: Move, limits: MotionLimits
) -> tuple[Filter, Floats]:
    """Return the filter before a move, and the move's reference within limits, shape (T, n) [rad].

    Raises:
        RecipeError: The motion has to be planned with a modal calibration, and there is none.
    """
    start, target = np.array(move.start), np.array(move.target)
    tvist = recipe.make(description, move.mass)
    tvist.reset(start)
    quiet = tvist.name == PLANNED
    tvist.aim(target, quiet=quiet)
    if not quiet:
        return tvist, samples_of(keeping_motion(JointLine(start, target), limits, tvist))
    arm = believed(recipe, description, move.mass)
    return tvist, samples_of(quiet_motion(JointLine(start, target), limits, arm, PERIOD))


def believed(recipe: Recipe, description: RobotDescription, mass: float) -> ElasticArm:
    """Return the controller's model of the flexible arm, with the recipe's error of the frequencies.

    Raises:
        RecipeError: There is no modal calibration.
    """
    known = recipe.calibration
    if known is None or known.modal is None:
        raise RecipeError(
            f"shaper {recipe.shaper} needs a modal calibration: make one with tvist identify --model modal"
        )
    return ElasticArm(description, _mistaken(known, recipe.frequency_error), paper_payload(description, mass))


def _mistaken(known: Calibration, error: float) -> Calibration:
    """Return a calibration whose arm has frequencies that are too high by a share, and the same damping ratios."""
    if known.modal is None or error == 0.0:
        return known

    def scaled(parameter: ModalParameter) -> ModalParameter:
        factor = (1.0 + error) ** _POWERS.get(parameter.quantity, 0)
        return replace(parameter, value=parameter.value * factor)

    return replace(known, modal=replace(known.modal, parameters=tuple(map(scaled, known.modal.parameters))))

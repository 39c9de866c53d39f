"""Create filters, moves and fixed shapers from a calibration as the server does, optionally with a wrong frequency."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import (
    ElasticFeedForward,
    JointLine,
    ModeSource,
    MotionLimits,
    OwnShaper,
    choose_filter,
    elastic_feed_forward,
    keeping_motion,
    known_friction,
    paper_payload,
    wanted_modes,
)
from tvist_lab.frequency_error import robust_over
from tvist_lab.recordings import Floats
from tvist_lab.study.line import samples_of
from tvist_lab.study.moves import Move
from tvist_lab.workspace import workspace
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter
from tvist_shaping.catalogue import shaper
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.named import Registry
from tvist_shaping.taps import mean_delay

CONFIGURATIONS = 150  # number of configurations over which the range of the lowest mode is determined
SEARCHED = 2000
"""Number of configurations searched for the longest mean delay; limits would be exceeded at a missed one."""

Range = tuple[float, float]


class RecipeError(ValueError):
    """There is no such filter for this arm; the message tells why."""


class FrequencyError(Estimator):
    """Another estimator's modes with wrong frequencies."""

    def __init__(self, right: Estimator, error: float) -> None:
        self._right, self._factor = right, 1.0 + error
        self.modes, self.f_d_min, self.zeta_max = right.modes, right.f_d_min * self._factor, right.zeta_max

    def __repr__(self) -> str:
        return f"{self._right!r} with frequencies times {self._factor:g}"

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the modes at a configuration; see `Estimator.estimate`."""
        return self._wrong(self._right.estimate(q))

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Compute the modes anew; see `Estimator.settle`."""
        return self._wrong(self._right.settle(q))

    def _wrong(self, modes: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        self.clipped = self._right.clipped
        f_d, zeta = modes
        return self._factor * f_d, zeta


@dataclass(frozen=True)
class Recipe:
    """Ingredients of a filter; unlike a filter, they can be sent to another process."""

    shaper: str  # name of a filter, as in `set_shaper`
    calibration: Calibration | None  # calibration of the arm; its modal model is preferred to its polynomials
    frequency_error: float = 0.0  # share by which every frequency is too high [-]
    modes: int = 1
    """Number of modes that a shaper of the catalogue suppresses; more than one requires a modal calibration."""
    own: tuple[OwnShaper, ...] = ()  # shapers from files, available by name besides those of the package

    def make(self, description: RobotDescription, mass: float) -> Filter:
        """Create the filter for the paper's disc with this declared mass [kg]."""
        known = Registry(own.shaper for own in self.own)
        modes = wanted_modes(self.shaper, self.modes, "shaper", known)
        if self.shaper == "none":
            return choose_filter(self.shaper, Fixed([10.0], [0.1]), description.joints)
        estimator = self.estimator(description, mass, modes)
        return choose_filter(self.shaper, estimator, description.joints, known=known)

    def elastic(self, description: RobotDescription, tvist: Filter) -> ElasticFeedForward | None:
        """Create the elastic feed-forward that the filter needs, if any."""
        if self.calibration is None:
            return None
        try:
            return elastic_feed_forward(tvist, description, self.calibration)
        except EstimatorError as error:
            raise RecipeError(f"shaper {self.shaper}: {error}") from error

    def friction(self, description: RobotDescription, tvist: Filter | None = None) -> Floats | None:
        """Return the friction fed forward with a filter or unshaped, see `known_friction`."""
        try:
            return known_friction(tvist, description, self.calibration)
        except EstimatorError as error:
            raise RecipeError(f"shaper {self.shaper}: {error}") from error

    def estimator(self, description: RobotDescription, mass: float, modes: int) -> Estimator:
        """Create the estimator that provides the filter's modes."""
        known = self.calibration
        if known is None:
            raise RecipeError(f"shaper {self.shaper} needs a calibration")
        if known.robot != description.robot.model:
            raise RecipeError(
                f"calibration {known.name} is for a {known.robot}, but this arm is a {description.robot.model}: "
                "give one of this arm"
            )
        source = ModeSource("polynomial" if known.modal is None else "modal", description, known)
        if modes > source.most:
            raise RecipeError(
                f"shaper {self.shaper} needs {modes} modes, but calibration {known.name} has {source.most}"
                + (": make one with tvist identify" if known.modal is None else "")
            )
        right = source.estimator(modes, paper_payload(description, mass))
        return FrequencyError(right, self.frequency_error) if self.frequency_error else right


def own_move(
    recipe: Recipe, description: RobotDescription, move: Move, limits: MotionLimits
) -> tuple[Filter, Floats]:
    """Return the filter at the start of a move and the move's reference within limits, shape (T, n) [rad]."""
    start, target = np.array(move.start), np.array(move.target)
    tvist = recipe.make(description, move.mass)
    tvist.reset(start)
    tvist.aim(target)
    return tvist, samples_of(keeping_motion(JointLine(start, target), limits, tvist))


def robust(name: str, recipe: Recipe, description: RobotDescription, masses: Range) -> Range:
    """Return design frequency [Hz] and damping ratio of a fixed shaper for the lowest mode over the workspace."""
    modes = _over_workspace(recipe, description, masses, 1, CONFIGURATIONS)
    f_d, zeta = np.array([(f_d[0], zeta[0]) for f_d, zeta in modes]).T
    most = 0.999 * shaper(name).zeta_max
    return robust_over(
        name, (float(f_d.min()), float(f_d.max())), (float(zeta.min()), min(float(zeta.max()), most))
    )


def longest_mean_delay(recipe: Recipe, description: RobotDescription, masses: Range, modes: int) -> float:
    """Return the longest mean delay of the product of the modes' ZV shapers, over workspace and payloads [s]."""
    return max(
        mean_delay(f_d, zeta) for f_d, zeta in _over_workspace(recipe, description, masses, modes, SEARCHED)
    )


def _over_workspace(
    recipe: Recipe, description: RobotDescription, masses: Range, modes: int, count: int
) -> Iterator[tuple[Floats, Floats]]:
    """Yield damped frequencies [Hz] and damping ratios [-] of the lowest modes, with smallest and largest payload."""
    region = workspace(description)
    for mass in sorted(set(masses)):
        estimator = recipe.estimator(description, mass, modes)
        for q in region.spread(count, description.joints, seed=0):
            yield estimator.estimate(q)

"""Filters for a move: as the server makes them, with a payload believed in and, on purpose, a wrong frequency."""

from dataclasses import dataclass, replace

from tvist_controller.api import (
    ModeSource,
    MotionLimits,
    OwnShaper,
    choose_filter,
    paper_payload,
    wanted_modes,
)
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.named import Registry


class RecipeError(ValueError):
    """There is no such filter for this arm; the sentence says why."""


class Mistaken(Estimator):
    """Another estimator's modes, at a frequency that is wrong by a share.

    Args:
        right: The other estimator.
        error: Share by which every frequency is too high [-], > -1.
    """

    def __init__(self, right: Estimator, error: float) -> None:
        self._right, self._factor = right, 1.0 + error

    def __repr__(self) -> str:
        return f"{self._right!r} with frequencies times {self._factor:g}"

    @property
    def modes(self) -> int:
        """Number of modes, the same as the other's."""
        return self._right.modes

    @property
    def f_d_min(self) -> float:
        """The other's, as wrong [Hz]."""
        return self._right.f_d_min * self._factor

    @property
    def zeta_max(self) -> float:
        """The other's."""
        return self._right.zeta_max

    def _part(self) -> None:
        self._right = self._right.fork()

    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Modes at a configuration; see `Estimator.estimate`."""
        return self._wrong(self._right.estimate(q))

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Modes anew; see `Estimator.settle`."""
        return self._wrong(self._right.settle(q))

    def _wrong(self, modes: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        self.clipped = self._right.clipped
        f_d, zeta = modes
        return self._factor * f_d, zeta


@dataclass(frozen=True)
class Recipe:
    """What a filter is made of; it travels between processes, where a filter would not."""

    shaper: str
    """Name of a filter, as in `set_shaper`."""
    calibration: Calibration | None
    """What is known of the arm; where there is a modal model, that, else polynomials."""
    frequency_error: float = 0.0
    """Share by which every frequency is too high [-]."""
    modes: int = 1
    """That a shaper of the catalogue suppresses; more than one takes a modal calibration."""
    own: tuple[OwnShaper, ...] = ()
    """Shapers from files, which may be named beside those that come with the package."""

    def make(self, description: RobotDescription, mass: float) -> Filter:
        """The filter for a payload that is believed to be the paper's disc, of another mass.

        Args:
            description: The robot.
            mass: Mass of the declared payload [kg].

        Raises:
            RecipeError: The calibration is of another arm, or does not know the modes that the filter wants.
            RefusalError: There is no such filter, or its parts do not go together.
        """
        known = Registry(own.shaper for own in self.own)
        modes = wanted_modes(self.shaper, self.modes, "shaper", known)
        if self.shaper == "none":
            return choose_filter(self.shaper, Fixed([10.0], [0.1]), description.joints)
        estimator = self.estimator(description, mass, modes)
        return choose_filter(self.shaper, estimator, description.joints, known=known)

    def estimator(self, description: RobotDescription, mass: float, modes: int) -> Estimator:
        """What the filter learns the modes from.

        Args:
            description: The robot.
            mass: Mass of the declared payload [kg].
            modes: How many.

        Raises:
            RecipeError: The calibration is of another arm, or does not know so many.
        """
        known = self.calibration
        if known is None:
            raise RecipeError(f"shaper {self.shaper} needs a calibration")
        if known.robot != description.robot.model:
            raise RecipeError(
                f"calibration {known.name} is for a {known.robot}, but this arm is a {description.robot.model}"
            )
        source = ModeSource("polynomial" if known.modal is None else "modal", description, known)
        if modes > source.most:
            raise RecipeError(
                f"shaper {self.shaper} needs {modes} modes, but calibration {known.name} has {source.most}"
                + (": make one with tvist identify --model modal" if known.modal is None else "")
            )
        right = source.estimator(modes, paper_payload(description, mass))
        return Mistaken(right, self.frequency_error) if self.frequency_error else right


def spared(limits: MotionLimits, tvist: Filter) -> MotionLimits:
    """What a reference is to keep so that the shaped one keeps these limits."""
    return replace(limits, acceleration=(1.0 - tvist.excess) * limits.acceleration)

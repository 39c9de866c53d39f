"""Candidates of the benchmark: filters by name, the product with held mean delay, and baselines."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_controller.api import ElasticFeedForward
from tvist_lab.evaluation.baselines import Baseline
from tvist_lab.evaluation.line import PAPER, lengthened
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.running import RunningShaper, Shaped, run
from tvist_lab.evaluation.sound import Sound
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter
from tvist_shaping.named import AIMED
from tvist_shaping.steady import ProductDesign, SteadyFilter


@dataclass(frozen=True)
class Task:
    """A reference to be shaped."""

    description: RobotDescription
    """The controller's model of the arm."""
    move: Move
    """The move; its mass is the declared one."""
    reference: Floats
    """Reference, shape (T, n) [rad]."""


class Candidate(ABC):
    """A way to shape a motion."""

    name: str
    """Name in JSON."""
    label: str
    """Name for people."""

    @property
    def told_target(self) -> bool:
        """Whether it is given the end of a motion before the motion begins, and therefore cannot shape a stream."""
        return False

    @abstractmethod
    def stepper(self, task: Task) -> RunningShaper | None:
        """Return the shaper, at rest at the start; None if it plans the whole motion instead of shaping a reference."""

    def elastic(self, task: Task) -> ElasticFeedForward | None:  # noqa: ARG002  most do without
        """Return the elastic feed-forward that the drives need; None for that of the paper's controller."""
        return None

    def shaped(self, task: Task) -> Shaped:
        """Shape a whole motion, and check it for tails.

        Raises:
            ShaperFaultError: The output is not a position, does not come to rest, or moves on after its end.
        """
        stepper = self.stepper(task)
        assert stepper is not None
        return run(stepper, task.reference)


@dataclass(frozen=True)
class Named(Candidate):
    """A filter by name, created as the server creates it."""

    recipe: Recipe
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """Whether the filter uses the target, which one of them does."""
        return self.recipe.shaper == AIMED

    def stepper(self, task: Task) -> "Filtering":
        """Return the filter, reset and given the target."""
        return _from_rest(self.recipe.make(task.description, task.move.mass), task)

    def elastic(self, task: Task) -> ElasticFeedForward | None:
        """Return what the filter needs."""
        return self.recipe.elastic(task.description, self.recipe.make(task.description, task.move.mass))


@dataclass(frozen=True)
class Held(Candidate):
    """The modes' zero-vibration shapers in series, delayed to a constant mean delay."""

    recipe: Recipe
    """Source of the estimates."""
    mean_delay: float
    """The constant mean delay [s]."""
    modes: int
    """Number of modes."""
    name: str
    label: str

    def stepper(self, task: Task) -> "Filtering":
        """Return the filter, reset."""
        description = task.description
        estimator = self.recipe.estimator(description, task.move.mass, self.modes)
        design = ProductDesign(self.mean_delay, modes=self.modes)
        return _from_rest(SteadyFilter(design, estimator, joints=description.joints), task)


@dataclass(frozen=True)
class Shaping(Candidate):
    """A baseline with a fixed shaper."""

    recipe: Recipe
    baseline: Baseline
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """Whether it is designed for the target."""
        return self.baseline.told_target

    def stepper(self, task: Task) -> "Filtering":
        """Return the fixed filter, reset; it knows the target if it is designed for it."""
        return _from_rest(self.baseline.tvist(self.recipe, task.description, task.move), task)


def _from_rest(tvist: Filter, task: Task) -> "Filtering":
    """Return a filter at rest at the start of a move, which is given the target as the robot does it."""
    tvist.reset(task.move.start)
    tvist.aim(task.move.target)
    return Filtering(Sound(tvist), lambda: tvist.delay)


@dataclass(frozen=True)
class Longer(Candidate):
    """A double S that takes as long as another candidate's motion, and uses no model."""

    like: Candidate
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """True, since it plans the motion."""
        return True

    def stepper(self, task: Task) -> None:  # noqa: ARG002
        """Return None, since it does not shape a reference."""
        return

    def shaped(self, task: Task) -> Shaped:
        """Return a double S with less jerk."""
        other = self.like.shaped(task)
        ticks = len(task.reference) + round(other.delay / PERIOD)
        start, target = np.array(task.move.start), np.array(task.move.target)
        return Shaped(lengthened(start, target, ticks, PAPER), other.delay, None)


@dataclass(frozen=True)
class Filtering:
    """A filter in operation."""

    step: Callable[[Floats], Floats]
    """Converts a sample to a shaped sample."""
    declared: Callable[[], float]
    """Returns the present delay of the filter."""

    @property
    def delay(self) -> float:
        """Delay of the last output [s]."""
        return self.declared()

"""What is judged on the bench: filters by name, the held product, and baselines."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tvist_lab.evaluation.baselines import Baseline
from tvist_lab.evaluation.line import PAPER, lengthened
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.running import RunningShaper, Shaped, run, sound
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
    """What the controller knows of the arm."""
    move: Move
    """From where to where; its mass is the one declared."""
    reference: Floats
    """Shape (T, n) [rad]."""


class Candidate(ABC):
    """A way to shape."""

    name: str
    """In JSON."""
    label: str
    """For people."""

    @property
    def told_target(self) -> bool:
        """Whether it is told where a motion ends before it begins: then it is nothing for a stream."""
        return False

    @abstractmethod
    def stepper(self, task: Task) -> RunningShaper | None:
        """At rest at the start; None for what plans the whole motion instead of shaping a reference."""

    def shaped(self, task: Task) -> Shaped:
        """A whole motion, watched for tails.

        Raises:
            ShaperFaultError: The output is no position, does not end, or goes on after its end.
        """
        stepper = self.stepper(task)
        assert stepper is not None
        return run(stepper, task.reference)


@dataclass(frozen=True)
class Named(Candidate):
    """A filter by its name, made as the server makes it."""

    recipe: Recipe
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """One filter makes use of it."""
        return self.recipe.shaper == AIMED

    def stepper(self, task: Task) -> "Filtering":
        """The filter, reset and aimed."""
        return _from_rest(self.recipe.make(task.description, task.move.mass), task)


@dataclass(frozen=True)
class Held(Candidate):
    """The modes' zero-vibration shapers, one after the other, held back to a constant mean delay."""

    recipe: Recipe
    """Says where estimates come from."""
    mean_delay: float
    """To which they are held back [s]."""
    modes: int
    """Number of modes."""
    name: str
    label: str

    def stepper(self, task: Task) -> "Filtering":
        """The filter, reset."""
        description = task.description
        estimator = self.recipe.estimator(description, task.move.mass, self.modes)
        design = ProductDesign(self.mean_delay, modes=self.modes)
        return _from_rest(SteadyFilter(design, estimator, joints=description.joints), task)


@dataclass(frozen=True)
class Shaping(Candidate):
    """A baseline that is a fixed shaper."""

    recipe: Recipe
    baseline: Baseline
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """Whether it is designed for the target."""
        return self.baseline.f_d is None

    def stepper(self, task: Task) -> "Filtering":
        """The fixed filter, reset; where it is designed for the target, that is known to it."""
        return _from_rest(self.baseline.tvist(self.recipe, task.description, task.move), task)


def _from_rest(tvist: Filter, task: Task) -> "Filtering":
    """A filter at rest where a move starts, told where it ends as the robot tells it."""
    tvist.reset(task.move.start)
    tvist.aim(task.move.target)
    return Filtering(sound(tvist), lambda: tvist.delay)


@dataclass(frozen=True)
class Longer(Candidate):
    """A double S that takes as long as another candidate's motion, and knows no model."""

    like: Candidate
    name: str
    label: str

    @property
    def told_target(self) -> bool:
        """It plans the way there."""
        return True

    def stepper(self, task: Task) -> None:  # noqa: ARG002
        """It shapes no reference."""
        return

    def shaped(self, task: Task) -> Shaped:
        """A double S with less jerk."""
        other = self.like.shaped(task)
        ticks = len(task.reference) + round(other.delay / PERIOD)
        start, target = np.array(task.move.start), np.array(task.move.target)
        return Shaped(lengthened(start, target, ticks, PAPER), other.delay, None)


@dataclass(frozen=True)
class Filtering:
    """A filter at work."""

    step: Callable[[Floats], Floats]
    """Sample to shaped sample."""
    declared: Callable[[], float]
    """Its delay now."""

    @property
    def delay(self) -> float:
        """Delay of the last output [s]."""
        return self.declared()

"""Methods, which shape, plan or replace a motion; each has a name in JSON and a label for display."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from tvist_controller.api.line import MotionLimits
from tvist_lab.recordings import Floats
from tvist_lab.study.line import PAPER, lengthened, point_to_point
from tvist_lab.study.moves import Move
from tvist_lab.study.recipes import Recipe, own_move, robust
from tvist_lab.study.shaping import RunningFilter, RunningShaper, Shaped, shape
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter
from tvist_shaping.named import AIMED
from tvist_shaping.steady import ProductDesign, SteadyFilter


@dataclass(frozen=True)
class Task:
    """A reference to shape, with the controller's knowledge of it."""

    description: RobotDescription  # the controller's model of the arm
    move: Move  # the move, with the declared mass
    reference: Floats  # reference, shape (T, n) [rad]
    limits: MotionLimits = PAPER
    as_served: bool = False
    """Whether to plan moves for the filter and accept the result, as a robot does. Otherwise the filter gets
    the reference itself, and its output is checked for motion after the declared end."""
    stream: bool = False  # whether the reference is a stream with unknown end
    ticks: int | None = None  # duration of the motion to compare with, if any


class Method(ABC):
    """A way to make a motion; a method can be sent to another process."""

    name: str
    label: str  # name for display

    @property
    def needs_target(self) -> bool:
        """Whether the method needs a motion's end in advance, and therefore cannot shape a stream."""
        return False

    @abstractmethod
    def shaped(self, task: Task) -> Shaped:
        """Return the whole motion."""


class WaitingMethod(Method):
    """The unshaped motion, as made by a robot that only waits for vibration to decay."""

    name, label = "waiting", "waiting, unshaped"

    def shaped(self, task: Task) -> Shaped:
        """Return the reference."""
        return Shaped(task.reference)


class SampleMethod(Method):
    """A method that shapes a reference sample by sample."""

    @abstractmethod
    def stepper(self, task: Task) -> RunningShaper:
        """Return the shaper, at rest at the start."""

    def shaped(self, task: Task) -> Shaped:
        """Shape the reference."""
        return self.driven(shape(self.stepper(task), task.reference, watched=not task.as_served), task)

    def driven(self, found: Shaped, task: Task) -> Shaped:  # noqa: ARG002  most do without
        """Return a shaped reference with the feed-forward that it needs."""
        return found


@dataclass(frozen=True)
class Named(SampleMethod):
    """A filter by name, created as on the server."""

    recipe: Recipe
    name: str
    label: str = ""
    alone: bool = False  # whether to omit the elastic feed-forward that the filter needs

    @property
    def needs_target(self) -> bool:
        """Whether the filter uses the target."""
        return self.recipe.shaper == AIMED

    def stepper(self, task: Task) -> RunningFilter:
        """Return the filter, reset and given the target."""
        return _from_rest(self.recipe.make(task.description, task.move.mass), task)

    def driven(self, found: Shaped, task: Task) -> Shaped:
        """Add the elastic feed-forward that the filter needs, and the friction to feed forward."""
        description = task.description
        tvist = self.recipe.make(description, task.move.mass)
        elastic = None if self.alone else self.recipe.elastic(description, tvist)
        return replace(found, elastic=elastic, law=self.recipe.friction(description, tvist))

    def shaped(self, task: Task) -> Shaped:
        """Shape the reference; if `as_served`, shape a motion planned for the filter, as a robot does."""
        if task.stream or not task.as_served:
            return super().shaped(task)
        tvist, own = own_move(self.recipe, task.description, task.move, task.limits)
        return self.driven(shape(RunningFilter(tvist), own, watched=False), task)


@dataclass(frozen=True)
class ConstantModes(SampleMethod):
    """A shaper of the catalogue with constant modes: those of the move's target, or of a whole range."""

    recipe: Recipe
    name: str
    label: str
    shaper: str
    modes: int = 1  # number of lowest modes at the move's target; each has a shaper
    f_d: float | None = None  # design frequency [Hz]; None for the estimate
    zeta: float | None = None  # design damping ratio [-]; None for the estimate
    for_payload: bool = False  # whether the shaper is designed for the declared payload

    @property
    def needs_target(self) -> bool:
        """Whether the shaper is designed for the end of each move."""
        return self.f_d is None and not self.for_payload

    def stepper(self, task: Task) -> RunningFilter:
        """Return the fixed filter, reset; a filter that is designed for the target gets it first."""
        made, description, mass = shaper(self.shaper), task.description, task.move.mass
        designed = (self.f_d, self.zeta)
        if self.for_payload:
            designed = robust(self.shaper, self.recipe, description, (mass, mass))
        if designed[0] is None or designed[1] is None:
            modes = self.recipe.estimator(description, mass, self.modes).estimate(np.array(task.move.target))
            f_d, zeta = (values.tolist() for values in modes)
        else:
            f_d, zeta = [designed[0]], [designed[1]]
        # Make the buffer long enough even if the estimated frequency is too low.
        longest = max(1.0, 1.01 * sum(made.duration_periods / f for f in f_d))
        return _from_rest(
            TvistFilter(made, Fixed(f_d, zeta), joints=description.joints, max_delay=longest), task
        )


@dataclass(frozen=True)
class ConstantMeanDelay(SampleMethod):
    """The modes' ZV shapers in series, delayed to a constant mean delay."""

    recipe: Recipe
    mean_delay: float  # the constant mean delay [s]
    modes: int
    name: str
    label: str

    def stepper(self, task: Task) -> RunningFilter:
        """Return the filter, reset."""
        description = task.description
        estimator = self.recipe.estimator(description, task.move.mass, self.modes)
        design = ProductDesign(self.mean_delay, modes=self.modes)
        return _from_rest(SteadyFilter(design, estimator, joints=description.joints), task)


class Planned(Method):
    """A method that plans a motion instead of shaping a reference; it cannot make streams or curved paths."""

    needs_target = True


@dataclass(frozen=True)
class StretchedDoubleS(Planned):
    """A double S with less jerk that takes as long as another motion, without a model."""

    name: str
    label: str
    like: Method | None = None  # method whose motion has the same duration; None to take that of the task

    def shaped(self, task: Task) -> Shaped:
        """Return a double S with less jerk."""
        delay = 0.0
        if self.like is None:
            assert task.ticks is not None, "the task is compared with a motion"
            ticks = task.ticks
        else:
            delay = self.like.shaped(task).delay
            ticks = len(task.reference) + round(delay / PERIOD)
        start, target = np.array(task.move.start), np.array(task.move.target)
        return Shaped(lengthened(start, target, ticks, task.limits), delay)


@dataclass(frozen=True)
class PeriodOfJerk(Planned):
    """A double S whose jerk lasts a period of the lowest mode at the target, so this mode is not excited."""

    recipe: Recipe
    name: str
    label: str

    def shaped(self, task: Task) -> Shaped:
        """Return a double S with this duration of jerk."""
        start, target = np.array(task.move.start), np.array(task.move.target)
        f_d = float(self.recipe.estimator(task.description, task.move.mass, 1).estimate(target)[0][0])
        limits = replace(task.limits, jerk=task.limits.acceleration * f_d)
        return Shaped(point_to_point(start, target, limits))


def _from_rest(tvist: Filter, task: Task) -> RunningFilter:
    """Return a filter at rest at a move's start; like a robot, tell it the target unless it is a stream."""
    tvist.reset(np.array(task.move.start))
    tvist.aim(None if task.stream else np.array(task.move.target))
    return RunningFilter(tvist)

"""The tasks of a sweep by position: one move of one robot with one payload and one error, made with every shaper.

A position determines everything that its task needs, seeds included, so that no result depends on the order of tasks,
on who does them, or on those done before. All shapers share the unshaped motion of a task, which is simulated once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import overload

from tvist_lab.evaluation.conditions import LIMITS, Conditions
from tvist_lab.evaluation.evaluate import arm_seed
from tvist_lab.evaluation.moves import Move, draw_moves
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.sweep.spec import Mistakes, Spec
from tvist_plant.description import RobotDescription


@dataclass(frozen=True)
class SweptRobot:
    """A robot with what its shapers are made of."""

    name: str
    """Name of the robot in the sweep's file."""
    description: RobotDescription
    """The arm, with the disturbances of the sweep, and the controller's model of it."""
    recipes: tuple[Recipe, ...]
    """Recipe of each shaper of the sweep, without errors."""


@dataclass(frozen=True)
class SweepTask:
    """One move of one robot with one payload and one error, and the shapers to make it with."""

    position: int
    """Place among the tasks, from 0 on."""
    robot: str
    """Name of the robot."""
    payload: str
    """The payload, as the axis says it."""
    mistakes: Mistakes
    """What the controller has wrong."""
    number: int
    """Number of the move among the robot's, from 1 on."""
    shapers: tuple[str, ...]
    """Names of the shapers."""
    recipes: tuple[Recipe, ...]
    """Recipe of each shaper, with the error of the frequencies."""
    description: RobotDescription
    """The arm."""
    move: Move
    """The move, with the carried mass."""
    conditions: Conditions
    """Limits, and what the controller does not know."""
    seed: int
    """Seed of gear errors and deviations, equal for all tasks with this number."""
    stream: bool
    """Whether to follow a stopped stream instead of the move."""


class SweepTasks(Sequence[SweepTask]):
    """All tasks of a sweep, each made when it is asked for.

    Args:
        spec: The sweep.
        robots: Its robots, in the order of the spec.
    """

    def __init__(self, spec: Spec, robots: Sequence[SweptRobot]) -> None:
        self.spec, self.robots = spec, tuple(robots)
        self._moves = [_drawn(spec, robot.description) for robot in robots]
        self._settings = list(product(range(len(robots)), spec.payloads, spec.errors))

    def __len__(self) -> int:
        return len(self._settings) * self.spec.moves

    @overload
    def __getitem__(self, position: int) -> SweepTask: ...
    @overload
    def __getitem__(self, position: slice) -> list[SweepTask]: ...
    def __getitem__(self, position: int | slice) -> SweepTask | list[SweepTask]:
        if isinstance(position, slice):
            return [self[one] for one in range(*position.indices(len(self)))]
        if not 0 <= position < len(self):
            raise IndexError(position)
        setting, number = divmod(position, self.spec.moves)
        place, payload, mistakes = self._settings[setting]
        robot, move = self.robots[place], self._moves[place][number]
        spec = self.spec
        if not isinstance(payload, str):
            move = replace(move, mass=float(payload))
        return SweepTask(
            position,
            robot.name,
            payload_name(payload),
            mistakes,
            number + 1,
            spec.shapers,
            tuple(replace(recipe, frequency_error=0.01 * mistakes.frequency) for recipe in robot.recipes),
            robot.description,
            move,
            Conditions(LIMITS[spec.limits], 0.01 * mistakes.payload, 0.01 * mistakes.stiffness),
            arm_seed(spec.seed, number),
            spec.streams,
        )


def payload_name(payload: float | str) -> str:
    """Return a value of the axis of payloads as text."""
    return payload if isinstance(payload, str) else f"{payload:.15g}"


def _drawn(spec: Spec, description: RobotDescription) -> list[Move]:
    """Draw moves that do not depend on the axis of payloads: those of `tvist evaluate --random` with this seed."""
    masses = (0.0, description.limits.payload)
    drawn = draw_moves(description, spec.moves, spec.seed, masses, wrists=spec.wrists, stroke=spec.stroke)
    return drawn.moves

"""The jobs of a sweep by position: one move of one robot with one payload and one error, made with every shaper.

A position determines everything that its job needs, seeds included, so that no result depends on the order of jobs,
on who does them, or on those done before. All shapers share the unshaped motion of a job, which is simulated once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from itertools import product
from typing import overload

import msgspec

from tvist_lab.study.arms import scattered
from tvist_lab.study.case import LIMITS, Case, arm_seed
from tvist_lab.study.columns import SCHEMA
from tvist_lab.study.engine import Plan, digest
from tvist_lab.study.method import Named
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.spec import Spec
from tvist_lab.study.work import Job
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


class Axes(Sequence[Job]):
    """All jobs of a sweep, each made when it is asked for.

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
    def __getitem__(self, position: int) -> Job: ...
    @overload
    def __getitem__(self, position: slice) -> list[Job]: ...
    def __getitem__(self, position: int | slice) -> Job | list[Job]:
        if isinstance(position, slice):
            return [self[one] for one in range(*position.indices(len(self)))]
        if not 0 <= position < len(self):
            raise IndexError(position)
        setting, number = divmod(position, self.spec.moves)
        place, payload, mistakes = self._settings[setting]
        robot, move, spec = self.robots[place], self._moves[place][number], self.spec
        if not isinstance(payload, str):
            move = replace(move, mass=float(payload))
        seed = arm_seed(spec.seed, number)
        axes = {
            "robot": robot.name,
            "payload": payload_name(payload),
            "payload_error_percent": mistakes.payload,
            "stiffness_error_percent": mistakes.stiffness,
            "frequency_error_percent": mistakes.frequency,
            "move": number + 1,
            "seed": seed,
            "payload_kg": move.mass,
            "start": list(move.start),
            "target": list(move.target),
        }
        arms = (scattered(0.01 * mistakes.stiffness),)
        case = Case(
            robot.description,
            move,
            seed,
            arms,
            LIMITS[spec.limits],
            0.01 * mistakes.payload,
            spec.streams,
            axes,
        )
        wrong = 0.01 * mistakes.frequency
        methods = (
            Named(replace(recipe, frequency_error=wrong), name)
            for recipe, name in zip(robot.recipes, spec.shapers, strict=True)
        )
        return Job(case, tuple(methods))

    def plan(self) -> Plan:
        """Return what the engine runs."""
        return Plan(self, SCHEMA, identity(self))


def identity(axes: Axes) -> dict[str, object]:
    """Return what determines the rows of a sweep, by names that a message can give."""
    robots = [
        {
            "model": robot.description.robot.model,
            "sha256": digest(robot.description),
            "calibration": robot.recipes[0].calibration and digest(robot.recipes[0].calibration),
        }
        for robot in axes.robots
    ]
    return {
        **msgspec.to_builtins(axes.spec),
        "contents of robots or calibrations": robots,
        "contents of shapers": [own.sha256 for recipe in axes.robots[0].recipes for own in recipe.own],
        "version of tvist": version("tvist"),
    }


def payload_name(payload: float | str) -> str:
    """Return a value of the axis of payloads as text."""
    return payload if isinstance(payload, str) else f"{payload:.15g}"


def _drawn(spec: Spec, description: RobotDescription) -> list[Move]:
    """Draw moves that do not depend on the axis of payloads: those of `tvist evaluate --random` with this seed."""
    masses = (0.0, description.limits.payload)
    drawn = draw_moves(description, spec.moves, spec.seed, masses, wrists=spec.wrists, stroke=spec.stroke)
    return drawn.moves

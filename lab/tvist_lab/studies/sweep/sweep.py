"""A sweep: its jobs by position, each one move of one robot with one payload and one error, made with every shaper.

A position determines everything that its job needs, seeds included, so that no result depends on the order of jobs,
on who does them, or on those done before. All shapers share the unshaped motion of a job, which is simulated once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from itertools import product
from typing import Any

import msgspec
import polars as pl

from tvist_lab.studies.sweep.spec import UNIFORM, Spec
from tvist_lab.study.arms import scattered
from tvist_lab.study.case import LIMITS, Case, arm_seed
from tvist_lab.study.columns import OF_STATUS, Column, Shares, columns_of, schema_of, summarized
from tvist_lab.study.engine import Plan, digest
from tvist_lab.study.measures import OF_PEAKS
from tvist_lab.study.method import Named
from tvist_lab.study.moves import Move, draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import FAILED, MEASURED, TOO_WEAK, Job
from tvist_plant.description import RobotDescription

COLUMNS = columns_of(
    (
        Column("robot", pl.String, "", "robot, as the spec names it"),
        Column("payload", pl.String, "", "payload, as the spec says it: a mass in kg, or uniform"),
        Column("payload_error_percent", pl.Float64, "%", "excess of the declared mass over the carried one"),
        Column(
            "stiffness_error_percent", pl.Float64, "%",
            "deviation of springs and velocity loops, up or down at random",
        ),
        Column("frequency_error_percent", pl.Float64, "%", "excess of the controller's frequencies"),
        Column("move", pl.Int64, "", "number of the random move of this robot, from 1 on"),
        Column("shaper", pl.String, "", "shaper, as the spec names it"),
        Column("seed", pl.Int64, "", "seed of gear errors and deviations, equal for equal `move`"),
        Column("payload_kg", pl.Float64, "kg", "carried mass"),
        Column("start", pl.List(pl.Float64), "rad", "joint angles at the start"),
        Column("target", pl.List(pl.Float64), "rad", "joint angles at the end"),
    ),
    OF_PEAKS,
)  # fmt: skip
"""All columns, in their order."""
SCHEMA = schema_of(COLUMNS)
"""Types of these columns."""
AXES = (
    "robot", "payload", "payload_error_percent", "stiffness_error_percent", "frequency_error_percent", "shaper",
)  # fmt: skip
"""Columns that together distinguish what is summarized."""
COUNTED = {
    "moves": pl.len(),
    "measured": OF_STATUS[MEASURED].sum(),
    "counted": pl.col("reduction_percent").is_not_null().sum(),
    "too_weak": OF_STATUS[TOO_WEAK].sum(),
    "failed": OF_STATUS[FAILED].sum(),
    "never_still": (OF_STATUS[MEASURED] & pl.col("shaped_still_after_ms").is_null()).sum(),
}
"""What is counted of each setting."""
FIGURES: Mapping[str, Shares] = {
    "reduction_percent": {"median": 0.5, "p5": 0.05},
    "less_than_waiting_percent": {"median": 0.5},
    "delay_ms": {"median": 0.5, "max": 1.0},
    "still_after_unshaped_stop_ms": {"median": 0.5, "p90": 0.9},
    "peak_acceleration_ratio": {"max": 1.0},
}
"""What is summarized of each setting."""
SHOWN = (
    Shown("setting", "setting"), Shown("shaper", "shaper"), Shown("moves", "measured"),
    Shown("delay ms", "delay_ms.median", 0), Shown("less %", "reduction_percent.median", 1),
    Shown("p5", "reduction_percent.p5", 1), Shown("than waiting", "less_than_waiting_percent.median", 1),
    Shown("still ms", "still_after_unshaped_stop_ms.median", 0), Shown("p90", "still_after_unshaped_stop_ms.p90", 0),
    Shown("q̈/limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
"""Table of a summary, whose entries have got the name of their setting."""


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

    def __getitem__(self, position: Any) -> Any:
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


def summary(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Return an entry for each combination of a sweep's axes, in the order of the rows.

    Percentiles of reductions are over the moves whose unshaped peak is worth a percentage, others over all measured.
    """
    late = pl.col("shaped_still_after_ms") - pl.col("unshaped_duration_ms")
    return summarized(rows.with_columns(still_after_unshaped_stop_ms=late), AXES, COUNTED, FIGURES)


def setting_name(entry: dict[str, Any]) -> str:
    """Return robot, payload and errors of an entry or a row as text, such as "ur5e, 2.5 kg, payload +10 %"."""
    carried = entry["payload"]
    names = [entry["robot"], carried if carried == UNIFORM else f"{carried} kg"]
    for kind, sign in (("payload", "+"), ("stiffness", ""), ("frequency", "+")):
        error = entry[f"{kind}_error_percent"]
        if error:
            names.append(f"{kind} {'±' if not sign else ''}{error:{sign}g} %")
    return ", ".join(names)

"""A sweep over the axes of a TOML file: shapers, payloads, errors and robots, with the same random moves.

The index of a case determines all its content, including seeds, so results do not depend on order, worker or
earlier cases. All shapers share the unshaped motion of a case, which is simulated once.
"""

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from tvist_lab.studies.moves import COLUMNS, SUMMED
from tvist_lab.study.case import LIMITS, Case, arm_seed
from tvist_lab.study.columns import Column, ResultTable, highest
from tvist_lab.study.method import Named
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe
from tvist_lab.study.study import Figures, Result, Study
from tvist_plant.description import RobotDescription
from tvist_plant.user_file import UserFileError, read_text, read_toml
from tvist_plant.variants import scattered
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError, quoted
from tvist_protocol.values import Mass

MOST_ROWS = 1_000_000  # largest number of rows of a sweep, which are held in memory at its end
UNIFORM = "uniform"  # payload that is drawn for each move, up to the arm's rating

Disturbance = Literal["friction", "gear", "noise"]
Name = Annotated[str, Meta(min_length=1, max_length=4096)]


class SpecError(UserFileError):
    """A sweep's file is invalid; the message names the file, and the key or line."""


class Mistakes(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Errors of the controller's knowledge, as one value of the axis `errors`."""

    payload: Annotated[float, Meta(ge=-100, le=900)] = 0.0
    """How much the declared mass exceeds the carried one [%]."""
    stiffness: Annotated[float, Meta(ge=0, le=90)] = 0.0
    """How much each gear, link and velocity loop is stiffer or softer, at random, than the controller knows [%]."""
    frequency: Annotated[float, Meta(ge=-90, le=900)] = 0.0
    """How much the controller overestimates every frequency [%]."""


class NamedRobot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A robot with the calibration of another."""

    robot: Name  # name of a robot that comes with the package, or path of a robot file
    calibration: Name  # name of a calibration that comes with the package, or path of a calibration file


class Spec(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A sweep."""

    shapers: Annotated[tuple[Name, ...], Meta(min_length=1)]  # names of shapers, or FILE.py:NAME
    moves: Annotated[int, Meta(ge=1, le=100_000)]
    payloads: Annotated[tuple[Mass | Name, ...], Meta(min_length=1)]
    """Masses of the disc on the flange [kg], or "uniform" for one drawn for each move up to the arm's rating."""
    errors: Annotated[tuple[Mistakes, ...], Meta(min_length=1)] = (Mistakes(),)
    """Errors of the controller's knowledge."""
    robots: Annotated[tuple[Name | NamedRobot, ...], Meta(min_length=1)] = ("ur5e",)
    """Names of robots, paths of robot files, or maps of robot and calibration."""
    seed: Annotated[int, Meta(ge=0, lt=2**62)] = 0  # seed of moves, payloads, gear errors and deviations
    modes: Annotated[int, Meta(ge=1, le=6)] = 1
    """Number of modes that each shaper of the catalogue suppresses."""
    limits: Literal["gentle", "industrial"] = "gentle"
    stroke: tuple[Annotated[float, Meta(ge=0.001, le=1)], Annotated[float, Meta(ge=0.001, le=1)]] = (0.3, 1.0)
    """Smallest and largest length of a move, as a share of the way between two configurations [-]."""
    wrists: bool = False  # whether moves turn the two outer joints of the wrist
    streams: bool = False  # whether to follow streams of set-points that are stopped, instead of making moves
    disturbances: tuple[Disturbance, ...] = ("friction", "gear", "noise")

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.moves * math.prod(map(len, (self.shapers, self.payloads, self.errors, self.robots)))


def read_spec(path: Path) -> Spec:
    """Read and check a sweep's file; raise SpecError if it is invalid."""
    text = read_text(path, "sweep")
    try:
        spec = checked(read_toml(path, "sweep"), Spec)
    except tomllib.TOMLDecodeError as error:
        raise SpecError(f"sweep {path}: it is not valid TOML: {error}") from error
    except ProtocolError as error:
        raise SpecError(f"sweep {path}{_line(text, error.where)}: {error.why}") from error
    for axis in ("shapers", "payloads", "errors", "robots", "disturbances"):
        _check_different(path, text, axis, getattr(spec, axis))
    for place, payload in enumerate(spec.payloads):
        if isinstance(payload, str) and payload != UNIFORM:
            raise SpecError(
                f"sweep {path}{_line(text, 'payloads')}: payloads[{place}] is {quoted(payload)}: "
                f"must be a mass from 0 to 100 kg, or {UNIFORM!r}"
            )
    if spec.stroke[0] > spec.stroke[1]:
        low, high = spec.stroke
        raise SpecError(f"sweep {path}{_line(text, 'stroke')}: stroke is {low:g} to {high:g}: must increase")
    if spec.rows > MOST_ROWS:
        raise SpecError(f"sweep {path}: it has {spec.rows} rows: must be at most {MOST_ROWS}")
    return spec


def _check_different(path: Path, text: str, axis: str, values: tuple[object, ...]) -> None:
    places: dict[object, int] = {}
    for place, value in enumerate(values):
        if (first := places.setdefault(value, place)) != place:
            raise SpecError(
                f"sweep {path}{_line(text, axis)}: {axis}[{place}] repeats {axis}[{first}]: values must differ"
            )


def _line(text: str, where: str) -> str:
    """Return ", line N" for a key at the top level if it can be found, else nothing."""
    key = re.escape(re.split(r"[.\[]", where, maxsplit=1)[0])
    found = [
        number
        for number, line in enumerate(text.splitlines(), 1)
        if key and re.match(rf"\s*(\[\[?\s*)?[\"']?{key}[\"']?\s*(=|\])", line)
    ]
    return f", line {found[0]}" if len(found) == 1 else ""


@dataclass(frozen=True)
class SweptRobot:
    """A robot, and the recipes for creating its shapers."""

    name: str
    description: RobotDescription
    """The arm with the sweep's disturbances; also the controller's model of the arm."""
    recipes: tuple[Recipe, ...]  # recipe of each shaper of the sweep, without errors


AXES = ("robot", "payload", "payload_error_percent", "stiffness_error_percent", "frequency_error_percent")
"""Columns that together identify a setting."""
DRAWN = 100  # largest number of settings in a figure


class Axes(Sequence[Case]):
    """All cases of a sweep, each created on access."""

    def __init__(self, spec: Spec, robots: Sequence[SweptRobot]) -> None:
        self.spec, self.robots = spec, tuple(robots)
        # Moves do not depend on the axis `payloads`: they equal those of `tvist study moves` with this seed.
        self._moves = [
            draw_moves(
                arm, spec.moves, spec.seed, (0.0, arm.limits.payload), wrists=spec.wrists, stroke=spec.stroke
            ).moves
            for arm in (robot.description for robot in robots)
        ]
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
        methods = (
            Named(replace(recipe, frequency_error=0.01 * mistakes.frequency), name)
            for recipe, name in zip(robot.recipes, spec.shapers, strict=True)
        )
        return Case(
            robot.description, move, arm_seed(spec.seed, number), (scattered(0.01 * mistakes.stiffness),),
            LIMITS[spec.limits], 0.01 * mistakes.payload, spec.streams, tuple(methods),
            {
                "robot": robot.name, "payload": payload if isinstance(payload, str) else f"{payload:.15g}",
                "payload_error_percent": mistakes.payload, "stiffness_error_percent": mistakes.stiffness,
                "frequency_error_percent": mistakes.frequency, "move": number + 1,
                "seed": arm_seed(spec.seed, number), "payload_kg": move.mass, "start": list(move.start),
                "target": list(move.target),
            },
        )  # fmt: skip


def study(spec: Spec, robots: Sequence[SweptRobot]) -> Study:
    """Return the study of a spec, with its robots loaded."""
    return Study(
        title="Sweep",
        cases=Axes(spec, robots),
        by=AXES,
        columns=COLUMNS,
        few=COLUMNS,
        more=(*SUMMED, highest("delay_ms")),
        tables=lambda result: [
            ResultTable("", result.values["summary"], [SETTING, Column("shaper", "shaper"), *COLUMNS])
        ],
        draw=_draw,
        identity={
            **msgspec.to_builtins(spec),
            "contents of robots or calibrations": [
                {
                    "model": robot.description.robot.model,
                    "sha256": digest(robot.description),
                    "calibration": robot.recipes[0].calibration and digest(robot.recipes[0].calibration),
                }
                for robot in robots
            ],
            "contents of shapers": [own.sha256 for recipe in robots[0].recipes for own in recipe.own],
        },
    )


def digest(content: object) -> str:
    """Return a short digest of a robot, a calibration or moves, which shows whether they have changed."""
    return sha256(msgspec.json.encode(content, order="sorted")).hexdigest()[:16]


def setting_name(entry: Mapping[str, Any]) -> str:
    """Return robot, payload and errors of an entry as text, such as "ur5e, 2.5 kg, payload +10 %"."""
    carried = entry["payload"]
    names = [entry["robot"], carried if carried == UNIFORM else f"{carried} kg"]
    for kind, sign in (("payload", "+"), ("stiffness", ""), ("frequency", "+")):
        error = entry[f"{kind}_error_percent"]
        if error:
            names.append(f"{kind} {'±' if not sign else ''}{error:{sign}g} %")
    return ", ".join(names)


SETTING = Column("setting", setting_name)


def _draw(result: Result) -> Figures:
    from tvist_lab.figures import sweep_figure

    entries = result.values["summary"]
    settings = list(map(setting_name, entries))
    if len(set(settings)) > DRAWN:
        return {}
    return {"sweep": (sweep_figure(entries, settings), "Reduction and delay of each shaper in each setting.")}

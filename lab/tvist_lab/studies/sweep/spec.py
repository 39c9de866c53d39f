"""What a sweep's TOML file says, checked: each fault is told with its key, its value and what is allowed."""

import math
import re
import tomllib
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_plant.user_file import UserFileError, read_text, read_toml
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError, quoted
from tvist_protocol.values import Mass

MOST_ROWS = 1_000_000
"""Largest number of rows of a sweep, which are held in memory at its end."""
UNIFORM = "uniform"
"""The payload that is drawn for each move, up to the arm's rating."""

Disturbance = Literal["friction", "gear", "noise"]
Name = Annotated[str, Meta(min_length=1, max_length=4096)]


class SpecError(UserFileError):
    """A sweep cannot be run as its file says; the message names the file, and the key or the line."""


class Mistakes(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """What the controller has wrong, as one value of the axis `errors`."""

    payload: Annotated[float, Meta(ge=-100, le=900)] = 0.0
    """By how much the declared mass exceeds the carried one [%]."""
    stiffness: Annotated[float, Meta(ge=0, le=90)] = 0.0
    """By how much each gear, link and velocity loop is stiffer or softer, at random, than the controller knows [%]."""
    frequency: Annotated[float, Meta(ge=-90, le=900)] = 0.0
    """By how much the controller overestimates every frequency [%]."""


class NamedRobot(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A robot with a calibration other than its own."""

    robot: Name
    """Name of a robot that comes with the package, or path of a robot file."""
    calibration: Name
    """Name of a calibration that comes with the package, or path of a calibration file."""


class Spec(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A sweep."""

    shapers: Annotated[tuple[Name, ...], Meta(min_length=1)]
    """Names of shapers, or FILE.py:NAME."""
    moves: Annotated[int, Meta(ge=1, le=100_000)]
    """Number of random moves of each robot."""
    payloads: Annotated[tuple[Mass | Name, ...], Meta(min_length=1)]
    """Masses of the disc on the flange [kg], or "uniform" for one drawn for each move up to the arm's rating."""
    errors: Annotated[tuple[Mistakes, ...], Meta(min_length=1)] = (Mistakes(),)
    """What the controller has wrong."""
    robots: Annotated[tuple[Name | NamedRobot, ...], Meta(min_length=1)] = ("ur5e",)
    """Names of robots, paths of robot files, or maps of robot and calibration."""
    seed: Annotated[int, Meta(ge=0, lt=2**62)] = 0
    """Seed of moves, payloads, gear errors and deviations."""
    modes: Annotated[int, Meta(ge=1, le=6)] = 1
    """Number of modes that each shaper of the catalogue suppresses."""
    limits: Literal["gentle", "industrial"] = "gentle"
    """Limits of the moves."""
    stroke: tuple[Annotated[float, Meta(ge=0.001, le=1)], Annotated[float, Meta(ge=0.001, le=1)]] = (0.3, 1.0)
    """Smallest and largest length of a move, as a share of the way between two configurations [-]."""
    wrists: bool = False
    """Whether moves turn the two outer joints of the wrist."""
    streams: bool = False
    """Whether to follow streams of set-points that are stopped, instead of making moves."""
    disturbances: tuple[Disturbance, ...] = ("friction", "gear", "noise")
    """Disturbances of the arms."""

    @property
    def rows(self) -> int:
        """Number of rows."""
        axes = (self.shapers, self.payloads, self.errors, self.robots)
        return self.moves * math.prod(map(len, axes))


def read_spec(path: Path) -> Spec:
    """Read and check a sweep's file.

    Raises:
        SpecError: A key is unknown or missing, a value is of another kind or out of range, an axis is empty or names
            something twice, or the file is not valid TOML.
        UserFileError: The file is not text, or too large.
        OSError: The file does not exist or cannot be read.
    """
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
        raise SpecError(f"sweep {path}: it has {spec.rows} rows: must have at most {MOST_ROWS}")
    return spec


def _check_different(path: Path, text: str, axis: str, values: tuple[object, ...]) -> None:
    places: dict[object, int] = {}
    for place, value in enumerate(values):
        if (first := places.setdefault(value, place)) != place:
            raise SpecError(
                f"sweep {path}{_line(text, axis)}: {axis}[{place}] repeats {axis}[{first}]: each value counts once"
            )


def _line(text: str, where: str) -> str:
    """Return ", line N" for a key at the top of the file that is easy to find; empty otherwise."""
    key = re.escape(re.split(r"[.\[]", where, maxsplit=1)[0])
    found = [
        number
        for number, line in enumerate(text.splitlines(), 1)
        if key and re.match(rf"\s*(\[\[?\s*)?[\"']?{key}[\"']?\s*(=|\])", line)
    ]
    return f", line {found[0]}" if len(found) == 1 else ""

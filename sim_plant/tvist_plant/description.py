"""A robot as described by its file: numbers with units, checked but not processed."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from tvist_plant.robot_checks import check, is_real_body
from tvist_plant.robot_tables import (
    DISTURBANCES,
    QUIET_STEP,
    Body,
    DescriptionError,
    Drives,
    Payload,
    RobotDescription,
    RobotFileError,
    Tensor,
)
from tvist_plant.similar import completed, with_limits
from tvist_plant.user_file import read_toml, toml

__all__ = [
    "DISTURBANCES",
    "QUIET_STEP",
    "Body",
    "DescriptionError",
    "Drives",
    "Payload",
    "RobotDescription",
    "Tensor",
    "is_real_body",
    "load",
    "robots",
]


def robots() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    folder = resources.files("tvist_plant") / "robots"
    return tuple(
        sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))
    )


def load(robot: str | Path) -> RobotDescription:
    """Read and check a robot file.

    Args:
        robot: Name of a robot that comes with the package, or path of a TOML or URDF file.

    Raises:
        DescriptionError: There is no such robot, or the file is invalid; the message names the key.
        UserFileError: The file is not text, too large, nested too deeply, or has its limits in degrees.
    """
    shipped = resources.files("tvist_plant") / "robots" / f"{robot}.toml"
    try:
        if isinstance(robot, str) and robot in robots():
            content = toml(shipped.read_text(encoding="utf-8"))
        elif Path(robot).suffix == ".urdf":
            from tvist_plant.urdf import read_urdf  # pinocchio is slow to import

            content = with_limits(read_urdf(robot))
        else:
            content = read_toml(robot, "robot file")
        content = completed(content)
        description = msgspec.convert(content, RobotDescription)
    except OSError as error:
        known = ", ".join(robots())
        raise DescriptionError(
            f"robot {str(robot)!r}: must be one of {known} or a readable file ({error.strerror})"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise RobotFileError(f"robot file {robot}: it is not valid TOML: {error}") from error
    except msgspec.ValidationError as error:
        raise RobotFileError(f"robot file {robot}: {_in_words(error, content)}") from error
    check(description, robot)
    if description.imperfections:
        _check_imperfections(description, robot)
    return description


def _check_imperfections(description: RobotDescription, source: str | Path) -> None:
    """Check the table of imperfections by converting it, and that this arm can have them.

    Raises:
        RobotFileError: A key is unknown, or a value wrong; the message names the file and the key.
    """
    from tvist_plant.imperfections import (
        GearLaw,
        Imperfections,
        imperfect_model,
    )  # pinocchio is slow to import

    table = {"imperfections": description.imperfections}
    try:
        made = Imperfections.of(description)
    except msgspec.ValidationError as error:
        said, _, path = str(error).partition(" - at `$")
        inner = path.rstrip("`")
        told = _in_words(msgspec.ValidationError(f"{said} - at `$.imperfections{inner}`"), table)
        raise RobotFileError(f"robot file {source}: {told}") from error
    known = msgspec.to_builtins(made)
    for key, value in description.imperfections.items():
        inner = known.get(key)
        more = value.keys() - inner.keys() if isinstance(value, dict) and isinstance(inner, dict) else set()
        for name in [key] * (key not in known) + [f"{key}.{one}" for one in sorted(more)]:
            keys = ", ".join(one.name for one in fields(getattr(made, key) if more else made))
            raise RobotFileError(
                f"robot file {source}: imperfections.{name:.200} is not a key of a robot file: must be one of {keys}"
            )
    try:
        GearLaw.of(made, description)
        imperfect_model(description, description.payload, made)
    except ValueError as error:
        raise RobotFileError(f"robot file {source}: imperfections: {error}") from error


_KINDS = {
    "float": "a number", "int": "a whole number", "str": "text", "array": "a list", "object": "a table",
    "bool": "true or false", "null": "nothing",
}  # fmt: skip
_RELATIONS = {">=": "at least", "<=": "at most", ">": "more than", "<": "less than", "": "exactly"}


def _in_words(error: msgspec.ValidationError, content: Any) -> str:
    """Return msgspec's message about a content, with the key, the value and the permitted values."""
    said, _, path = str(error).partition(" - at `$")
    key = path.rstrip("`").removeprefix(".")
    value = content
    for name, index in re.findall(r"([A-Za-z_][^.\[]*)|\[(\d+)\]", key):
        try:
            value = value[int(index) if index else name]
        except (TypeError, LookupError):
            value = None
    key = key.replace("[...]", ".<one of its keys>")[:200]
    for pattern, words in _RULES:
        if found := re.fullmatch(pattern, said):
            return words(key, value, *found.groups())
    return f"{key or 'the file'}: {said.replace('`', ''):.300}"


def _missing(key: str, _: Any, name: str) -> str:
    return f"{_joined(key, name)} is missing"


def _unknown(key: str, _: Any, name: str) -> str:
    return f"{_joined(key, name):.200} is not a key of a robot file"


def _bound(key: str, value: Any, relation: str, limit: str) -> str:
    return f"{key} is {value!r:.60}: must be {_RELATIONS[relation]} {float(limit):g}"


def _length(key: str, value: Any, relation: str, limit: str) -> str:
    count = len(value) if isinstance(value, list | str) else "another number of"
    return f"{key} has {count} entries: must have {_RELATIONS[relation]} {limit}"


def _kind(key: str, value: Any, wanted: str, got: str) -> str:
    found = f" is {_called(got)}, {value!r:.60}:" if key else ""
    return f"{key or 'the file'}{found} must be {_called(wanted)}"


_RULES: tuple[tuple[str, Callable[..., str]], ...] = (
    (r"Object missing required field `(.*)`", _missing),
    (r"Object contains unknown field `(.*)`", _unknown),
    (r"Expected `(?:float|int)` (>=|<=|>|<) (\S+)", _bound),
    (r"Expected `(?:array|str)` of length (>=|<=|) ?(\d+)(?:, got \d+)?", _length),
    (r"Expected `([^`]*)`, got `([^`]*)`", _kind),
)


def _joined(key: str, name: str) -> str:
    return f"{key}.{name}".removeprefix(".")


def _called(said: str) -> str:
    return " or ".join(_KINDS.get(kind, kind) for kind in said.split(" | "))

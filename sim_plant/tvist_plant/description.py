"""A robot as described by its file: numbers with units, checked but not processed."""

import tomllib
from importlib import resources
from pathlib import Path

import msgspec

from tvist_plant._words import in_words
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
from tvist_plant.urdf import read_urdf
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
        raise RobotFileError(f"robot file {robot}: {in_words(error, content)}") from error
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
        told = in_words(msgspec.ValidationError(f"{said} - at `$.imperfections{inner}`"), table)
        raise RobotFileError(f"robot file {source}: {told}") from error
    known = msgspec.to_builtins(made)
    for key, value in description.imperfections.items():
        inner = known.get(key)
        more = value.keys() - inner.keys() if isinstance(value, dict) and isinstance(inner, dict) else set()
        for name in [key] * (key not in known) + [f"{key}.{one}" for one in sorted(more)]:
            raise RobotFileError(
                f"robot file {source}: imperfections.{name:.200} is not a key of a robot file"
            )
    try:
        GearLaw.of(made, description)
        imperfect_model(description, description.payload, made)
    except ValueError as error:
        raise RobotFileError(f"robot file {source}: imperfections: {error}") from error

"""A robot file's content: numbers with units, validated but not processed."""

import tomllib
from hashlib import sha256
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from tvist_plant.robot_checks import check, in_words, is_real_body
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
    "fingerprint",
    "is_real_body",
    "load",
    "robots",
]

_ROBOTS = resources.files("tvist_plant") / "robots"
_VIBRATING = (
    "gear_stiffness", "gear_damping", "rotor_inertia", "velocity_gain", "position_gain", "integral_gain",
    "coulomb_friction", "friction_width",
)  # fmt: skip
"""Drive parameters that determine frequency and damping; feed-forward and gear error only excite vibration."""


def robots() -> tuple[str, ...]:
    """Return the names of the robots that come with the package."""
    files = (entry.name for entry in _ROBOTS.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml")))


def load(robot: str | Path) -> RobotDescription:
    """Read and check the robot file of that name or path (TOML or URDF).

    Raise DescriptionError if there is no such robot or the file is invalid; the message names the key. Raise
    UserFileError if the file is not text, too large, nested too deeply, or has its limits in degrees.
    """
    try:
        content = completed(_content(robot))
        description = msgspec.convert(content, RobotDescription)
        check(description)
    except OSError as error:
        known = ", ".join(robots())
        raise DescriptionError(
            f"robot {str(robot)!r}: must be one of {known} or a readable file ({error.strerror})"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise RobotFileError(f"robot file {robot}: it is not valid TOML: {error}") from error
    except msgspec.ValidationError as error:
        raise RobotFileError(f"robot file {robot}: {in_words(error, content)}") from error
    except RobotFileError as error:
        raise RobotFileError(f"robot file {robot}: {error}") from error
    return description


def _content(robot: str | Path) -> dict[str, Any]:
    if isinstance(robot, str) and robot in robots():
        return toml((_ROBOTS / f"{robot}.toml").read_text(encoding="utf-8"))
    if Path(robot).suffix == ".urdf":
        from tvist_plant.urdf import read_urdf  # pinocchio is slow to import

        return with_limits(read_urdf(robot))
    return read_toml(robot, "robot file")


def fingerprint(description: RobotDescription) -> str:
    """Return 16 hexadecimal digits, equal on all machines for robot files with equal vibration.

    They cover geometry, masses, springs, dampers and drive gains. Names, limits, poses, collision bodies and
    sensors do not count, nor does the payload, which a calibration stores itself.
    """
    drives = [getattr(description.drives, name) for name in _VIBRATING]
    parts = (description.kinematics, description.links, description.link_flexibility, drives)
    return sha256(msgspec.json.encode(parts, order="sorted")).hexdigest()[:16]

"""Checks of a robot file that types cannot express."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from tvist_plant.robot_tables import (
    MAX_JOINTS,
    ORIGINS,
    Kinematics,
    RobotDescription,
    RobotFileError,
    Tensor,
)
from tvist_plant.user_file import LONGEST_NAME, UserFileError, is_name

MAX_POSITION: Final = 20.0 * math.pi
"""Largest position limit that is accepted as radians: ten turns in either direction [rad]."""
MAX_VELOCITY: Final = 16.0 * math.pi
"""Largest velocity limit that is accepted as radians: eight turns per second [rad/s]."""


def check(description: RobotDescription, source: str | Path) -> None:
    """Check lengths, limits, bodies and names of a robot file.

    Raises:
        RobotFileError: Something is wrong; the message names the file, the key and what is allowed.
        UserFileError: A limit is probably in degrees.
    """
    _check_names(description, source)
    _check(description, source)
    check_limits(description.limits.position, description.limits.velocity, f"robot file {source}")
    _check_bodies(description, source)
    _check_provenance(description, source)


def check_limits(position: Sequence[float], velocity: Sequence[float], source: str) -> None:
    """Refuse limits that only make sense in degrees, which would be no limits at all.

    Raises:
        UserFileError: A limit exceeds `MAX_POSITION` or `MAX_VELOCITY`; the message gives it in both units.
    """
    for key, values, most, per in (
        ("position", position, MAX_POSITION, ""),
        ("velocity", velocity, MAX_VELOCITY, "/s"),
    ):
        for joint, value in enumerate(values):
            if value > most:
                raise UserFileError(
                    f"{source}: limits.{key}[{joint}] is {value:g} rad{per}, and at most {most:.1f} rad{per} are "
                    f"supported: if degrees were meant, write {math.radians(value):.6g} rad{per}"
                )


def is_real_body(inertia: Tensor) -> bool:
    """Return whether the principal moments are physically possible: none negative, none above the sum of the others."""
    least, middle, most = _principal(inertia)
    return least >= -1e-9 * most and most <= (least + middle) * (1.0 + 1e-6)


def lacking_inertia(inertia: Tensor) -> float:
    """Return what all principal moments lack at least to be physically possible; 0 for a real body [kg m^2]."""
    least, middle, most = _principal(inertia)
    return 0.0 if is_real_body(inertia) else max(most - least - middle, -least)


def _principal(inertia: Tensor) -> list[float]:
    """Principal moments, the least first [kg m^2]."""
    xx, xy, xz, yy, yz, zz = inertia
    found: list[float] = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).tolist()
    return found


def _check_names(description: RobotDescription, source: str | Path) -> None:
    """Check that names, which go to terminals, pages and other programs, can be shown there."""
    robot, bodies = description.robot, description.collision.bodies
    names = {"robot.name": [robot.name], "robot.model": [robot.model], "robot.joints": robot.joints}
    names |= {"collision.bodies": [body.name for body in bodies], "poses": list(description.poses)}
    names["provenance"] = list(description.provenance)
    for key, found in names.items():
        for name in found:
            if not is_name(name):
                raise RobotFileError(
                    f"robot file {source}: {key} has the name {name!r:.{LONGEST_NAME}}: "
                    f"must be at most {LONGEST_NAME} printable characters"
                )


def _check(description: RobotDescription, source: str | Path) -> None:
    """Check what types cannot express, such as lengths that must agree and links that must exist."""
    joints = description.joints
    if not 1 <= joints <= MAX_JOINTS:
        raise RobotFileError(
            f"robot file {source}: robot.joints has {joints} names; 1 to {MAX_JOINTS} are supported"
        )
    _check_kinematics(description.kinematics, source)
    for table in ("kinematics", "links", "limits", "drives"):
        values = getattr(description, table)
        for key in values.__struct_fields__:
            value = getattr(values, key)
            if table == "kinematics" and not value:
                continue
            if isinstance(value, tuple) and len(value) != joints:
                raise RobotFileError(
                    f"robot file {source}: {table}.{key} has {len(value)} entries; robot.joints has {joints}"
                )
    flexible = description.link_flexibility
    if len(flexible.links) != len(flexible.stiffness):
        raise RobotFileError(
            f"robot file {source}: link_flexibility.stiffness has {len(flexible.stiffness)} entries; "
            f"link_flexibility.links has {len(flexible.links)}"
        )
    possible = [link for link, length in enumerate(description.kinematics.a) if length != 0.0]
    if len(set(flexible.links)) < len(flexible.links) or not set(flexible.links).issubset(possible):
        raise RobotFileError(
            f"robot file {source}: link_flexibility.links is {list(flexible.links)}; "
            f"each may occur only once and must be one of {possible}, whose length kinematics.a is not 0"
        )
    _check_collision(description, source)
    for name, pose in description.poses.items():
        if len(pose) != joints:
            raise RobotFileError(
                f"robot file {source}: poses.{name} has {len(pose)} entries; robot.joints has {joints}"
            )


def _check_kinematics(kinematics: Kinematics, source: str | Path) -> None:
    """Check that the frames of the links are given in one way."""
    given = [key for key in ("a", "d", "alpha") if getattr(kinematics, key)]
    if kinematics.placement and given:
        raise RobotFileError(
            f"robot file {source}: kinematics has placement and {', '.join(given)}: give one or the other"
        )
    missing = [key for key in ("a", "d", "alpha") if key not in given]
    if not kinematics.placement and missing:
        raise RobotFileError(f"robot file {source}: kinematics.{missing[0]} is missing")


def _check_collision(description: RobotDescription, source: str | Path) -> None:
    """Check that bodies belong to links that exist, and that pairs name bodies."""
    names = [body.name for body in description.collision.bodies]
    known = {*names, "payload"}
    if len(known) <= len(names):
        raise RobotFileError(
            f"robot file {source}: collision.bodies has the names {names}; "
            "each may occur only once, and the names payload and floor are reserved"
        )
    for body in description.collision.bodies:
        if body.link >= description.joints:
            raise RobotFileError(
                f"robot file {source}: collision.bodies: {body.name} has link {body.link}; "
                f"it must be below {description.joints}"
            )
    for pair in description.collision.apart:
        if not known.issuperset(pair):
            raise RobotFileError(
                f"robot file {source}: collision.apart has {list(pair)}; the bodies are {sorted(known)}"
            )


def _check_bodies(description: RobotDescription, source: str | Path) -> None:
    """Check that every inertia is physically possible."""
    links = {f"links.inertia[{number}]": inertia for number, inertia in enumerate(description.links.inertia)}
    for key, inertia in {**links, "payload.inertia": description.payload.inertia}.items():
        if not is_real_body(inertia):
            raise RobotFileError(
                f"robot file {source}: {key} is {list(inertia)}; no body can have this: "
                "a principal moment is negative or larger than the other two together"
            )


def _check_provenance(description: RobotDescription, source: str | Path) -> None:
    """Check that what is said to come from somewhere exists, and that the kind of its source is known."""
    for key, origin in description.provenance.items():
        value: object = description
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else getattr(value, part, None)
        if value is None or key.startswith("_"):
            raise RobotFileError(f"robot file {source}: provenance.{key}: there is no such table or key")
        kind, colon, words = origin.partition(":")
        if kind not in ORIGINS or not colon or not words.strip():
            raise RobotFileError(
                f"robot file {source}: provenance.{key} is {origin!r:.200}: "
                f"must be one of {', '.join(ORIGINS)}, a colon and the source"
            )

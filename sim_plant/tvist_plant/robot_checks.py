"""Checks of a robot file beyond its types, and readable messages for msgspec's type errors."""

import math
import re
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct, structs

from tvist_plant.robot_tables import (
    MAX_JOINTS,
    ORIGINS,
    Imperfections,
    RobotDescription,
    RobotFileError,
    Tensor,
    matrix,
)
from tvist_plant.user_file import LONGEST_NAME, is_name

MAX_POSITION = 20.0 * math.pi
"""Largest position limit accepted as radians: ten turns in either direction [rad]."""
MAX_VELOCITY = 16.0 * math.pi
"""Largest velocity limit accepted as radians: eight turns per second [rad/s]."""


def check(description: RobotDescription) -> None:
    """Check lengths, limits, bodies and names of a robot file; raise RobotFileError."""
    for what in (_names, _joints, _collision, _limits, _bodies, _provenance, _imperfections):
        for said in what(description):
            raise RobotFileError(said)


def is_real_body(inertia: Tensor) -> bool:
    """Return whether the principal moments are possible: none negative, none above the sum of the others."""
    return lacking_inertia(inertia) == 0.0


def lacking_inertia(inertia: Tensor) -> float:
    """Return how much principal moments lack to be physically possible; 0 if they are possible [kg m^2]."""
    least, middle, most = np.linalg.eigvalsh(matrix(inertia)).tolist()
    if least >= -1e-9 * most and most <= (least + middle) * (1.0 + 1e-6):
        return 0.0
    return float(max(most - least - middle, -least))


def _names(description: RobotDescription) -> Iterator[str]:
    """Check that names are printable and short, since terminals, pages and other programs show them."""
    robot, bodies = description.robot, description.collision.bodies
    names = {
        "robot.name": [robot.name], "robot.model": [robot.model], "robot.joints": robot.joints,
        "collision.bodies": [body.name for body in bodies], "poses": description.poses,
        "provenance": description.provenance,
    }  # fmt: skip
    for key, found in names.items():
        for name in found:
            if not is_name(name):
                yield (
                    f"{key} has the name {name!r:.{LONGEST_NAME}}: "
                    f"must be at most {LONGEST_NAME} printable characters"
                )


def _joints(description: RobotDescription) -> Iterator[str]:
    """Check that each joint has one entry, and link frames and bending links are given in only one way."""
    joints, kinematics, flexible = description.joints, description.kinematics, description.link_flexibility
    if not 1 <= joints <= MAX_JOINTS:
        yield f"robot.joints has {joints} names: must be 1 to {MAX_JOINTS}"
    given = [key for key in ("a", "d", "alpha") if getattr(kinematics, key)]
    if kinematics.placement and given:
        yield f"kinematics has placement and {', '.join(given)}: give one or the other"
    missing = [key for key in ("a", "d", "alpha") if key not in given]
    if not kinematics.placement and missing:
        yield f"kinematics.{missing[0]} is missing"
    given = ["placement"] if kinematics.placement else given
    sized = {f"kinematics.{key}": getattr(kinematics, key) for key in given}
    for table in ("links", "limits", "drives"):
        values = msgspec.structs.asdict(getattr(description, table))
        sized |= {f"{table}.{key}": value for key, value in values.items() if isinstance(value, tuple)}
    sized |= {f"poses.{name}": pose for name, pose in description.poses.items()}
    for key, value in sized.items():
        if len(value) != joints:
            yield f"{key} has {len(value)} entries: must be {joints}, one for each of robot.joints"
    if len(flexible.links) != len(flexible.stiffness):
        yield (
            f"link_flexibility.stiffness has {len(flexible.stiffness)} entries: must be {len(flexible.links)}, "
            "one for each of link_flexibility.links"
        )
    possible = [link for link, length in enumerate(kinematics.a) if length != 0.0]
    if len(set(flexible.links)) < len(flexible.links) or not set(flexible.links).issubset(possible):
        yield (
            f"link_flexibility.links is {list(flexible.links)}: must be different ones of {possible}, "
            "whose length kinematics.a is not 0"
        )


def _collision(description: RobotDescription) -> Iterator[str]:
    """Check that collision bodies belong to existing links and pairs to existing bodies."""
    names = [body.name for body in description.collision.bodies]
    known = {*names, "payload"}
    if len({*known, "floor"}) < len(names) + 2:
        yield f"collision.bodies has names {names}: all must differ, also from payload and floor"
    for body in description.collision.bodies:
        if body.link >= description.joints:
            yield (f"collision.bodies: {body.name} has link {body.link}: must be below {description.joints}")
    for pair in description.collision.apart:
        if not known.issuperset(pair):
            yield f"collision.apart has {list(pair)}: must be two of {sorted(known)}"


def _limits(description: RobotDescription) -> Iterator[str]:
    """Refuse limits that must be in degrees: in radians they would be so large that they limit nothing."""
    limits = description.limits
    for key, values, most, unit in (
        ("position", limits.position, MAX_POSITION, "rad"),
        ("velocity", limits.velocity, MAX_VELOCITY, "rad/s"),
    ):
        for joint, value in enumerate(values):
            if value > most:
                yield (
                    f"limits.{key}[{joint}] is {value:g} {unit}: must be at most {most:.1f} {unit}; "
                    f"if you mean degrees, write {math.radians(value):.6g} {unit}"
                )


def _bodies(description: RobotDescription) -> Iterator[str]:
    links = {f"links.inertia[{number}]": inertia for number, inertia in enumerate(description.links.inertia)}
    for key, inertia in {**links, "payload.inertia": description.payload.inertia}.items():
        if not is_real_body(inertia):
            yield (
                f"{key} is {list(inertia)}: must be possible for a body, with no principal moment negative or larger "
                "than the other two together"
            )


def _provenance(description: RobotDescription) -> Iterator[str]:
    """Check that provenance refers to existing keys and known kinds of sources."""
    for key, origin in description.provenance.items():
        value: object = description
        for part in key.split("."):
            known = (
                value
                if isinstance(value, dict)
                else structs.asdict(value)
                if isinstance(value, Struct)
                else {}
            )
            value = known.get(part)
        if value is None or key.startswith("_"):
            yield f"provenance.{key}: there is no such table or key"
        kind, _, words = origin.partition(":")
        if kind not in ORIGINS or not words.strip():
            yield (
                f"provenance.{key} is {origin!r:.200}: "
                f"must be one of {', '.join(ORIGINS)}, a colon and the source"
            )


def _imperfections(description: RobotDescription) -> Iterator[str]:
    """Check that the imperfections are possible for this arm."""
    given = description.imperfections
    if given == Imperfections():
        return
    from tvist_plant.drives import joint_parameters  # pinocchio is slow to import
    from tvist_plant.imperfections import imperfect_model

    try:
        joint_parameters(description, given)
        imperfect_model(description, description.payload, given)
    except ValueError as error:
        yield f"imperfections: {error}"


_KINDS = {
    "float": "a number", "int": "a whole number", "str": "text", "array": "a list", "object": "a table",
    "bool": "true or false", "null": "nothing",
}  # fmt: skip
_RELATIONS = {">=": "at least", "<=": "at most", ">": "more than", "<": "less than", "": "exactly"}


def in_words(error: msgspec.ValidationError, content: Any) -> str:
    """Turn msgspec's message into one with the key, the value and the permitted values."""
    said, _, path = str(error).partition(" - at `$")
    key = path.rstrip("`").removeprefix(".")
    value = content
    for name, index in re.findall(r"([A-Za-z_][^.\[]*)|\[(\d+)\]", key):
        try:
            value = value[int(index) if index else name]
        except (TypeError, LookupError):
            value = None
    key = key.replace("[...]", ".<one of its keys>")[:200]
    if found := re.fullmatch(r"Object (missing required|contains unknown) field `(.*)`", said):
        inner = f"{key}.{found[2]}".removeprefix(".")
        lacks = found[1] == "missing required"
        return f"{inner} is missing" if lacks else f"{inner:.200} is not a key of a robot file"
    if found := re.fullmatch(r"Expected `(?:float|int)` (>=|<=|>|<) (\S+)", said):
        return f"{key} is {value!r:.60}: must be {_RELATIONS[found[1]]} {float(found[2]):g}"
    if found := re.fullmatch(r"Expected `(?:array|str)` of length (>=|<=|) ?(\d+)(?:, got \d+)?", said):
        count = len(value) if isinstance(value, list | str) else "another number of"
        return f"{key} has {count} entries: must have {_RELATIONS[found[1]]} {found[2]}"
    if found := re.fullmatch(r"Expected `([^`]*)`, got `([^`]*)`", said):
        wanted, got = (
            " or ".join(_KINDS.get(kind, kind) for kind in kinds.split(" | ")) for kinds in found.groups()
        )
        return f"{key} is {got}, {value!r:.60}: must be {wanted}" if key else f"the file must be {wanted}"
    return f"{key or 'the file'}: {said.replace('`', ''):.300}"

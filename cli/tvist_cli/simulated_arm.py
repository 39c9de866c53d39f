"""Options about the simulated arm: its disturbances, and the payloads that it carries."""

import math
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told

if TYPE_CHECKING:
    from tvist_plant.description import RobotDescription

UNIFORM = "uniform"
"""Value of --payload that draws a payload for each motion, up to the arm's rating."""


def disturbed(
    description: "RobotDescription", wanted: str | None, *, clean: bool
) -> tuple["RobotDescription", tuple[str, ...]]:
    """Return the arm with the requested disturbances, and their names."""
    from tvist_plant.description import DISTURBANCES, DescriptionError

    if clean and wanted is not None:
        raise Failure("give either --clean or --disturbances", code=2)
    if wanted is None:
        wanted = "none" if clean else ",".join(DISTURBANCES)
    names = [] if wanted == "none" else [name.strip() for name in wanted.split(",")]
    with told(DescriptionError, code=2):
        return description.disturbed_by(names), tuple(name for name in DISTURBANCES if name in names)


def named(kept: tuple[str, ...]) -> str:
    """Describe an arm with these disturbances."""
    from tvist_plant.description import DISTURBANCES

    if kept == DISTURBANCES:
        return "as described"
    return f"with {' and '.join(kept)} alone" if kept else "clean"


def masses_of(payload: str | None, description: "RobotDescription") -> tuple[float, float]:
    """Least and largest mass."""
    if payload == UNIFORM:
        return 0.0, description.limits.payload
    if payload is None:
        return description.payload.mass, description.payload.mass
    try:
        mass = float(payload)
    except ValueError:
        mass = math.nan
    if not 0.0 <= mass <= 100.0:
        raise Failure(f"payload is {payload!r}: must be a mass from 0 to 100 kg, or {UNIFORM}", code=2)
    return mass, mass

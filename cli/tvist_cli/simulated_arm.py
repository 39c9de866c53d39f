"""Options about the simulated arm: its disturbances, the payloads that it carries, and what is drawn at random."""

import math
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told

if TYPE_CHECKING:
    from tvist_plant.description import RobotDescription

UNIFORM = "uniform"
"""Value of --payload that draws a payload for each motion, up to the arm's rating."""


def check_count(name: str, count: int, most: int) -> None:
    """Refuse a number of motions, the option `name`, that is not from 1 to `most`."""
    if not 1 <= count <= most:
        raise Failure(f"{name} is {count}: must be 1 to {most}", code=2)


def check_seed(seed: int, bits: int = 62) -> None:
    """Refuse a seed that is negative or has more bits."""
    if not 0 <= seed < 2**bits:
        raise Failure(f"seed is {seed}: must be at least 0 and less than 2^{bits}", code=2)


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

"""Options about the simulated arm: its disturbances, and the payloads that it carries."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.studying import check_seed

if TYPE_CHECKING:
    from tvist_controller.api.line import MotionLimits
    from tvist_plant.description import RobotDescription
    from tvist_plant.variants import Variant

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


def plants_of(
    names: Sequence[str] | None, hidden: Sequence[int] | None, description: "RobotDescription"
) -> "list[Variant]":
    """Plants of these names and hidden robots of these seeds; by default those that robustness is judged by."""
    from tvist_lab.study.arms import JUDGED
    from tvist_plant.variants import hidden_variant, variant

    for seed in hidden or ():
        check_seed(seed)
    if names is None:
        names = [] if hidden else JUDGED
    with told(ValueError, code=2):
        found = [*(variant(name.lower()) for name in names), *map(hidden_variant, hidden or ())]
        for one in found:
            one.make(description, description.payload, 0)  # says what this arm cannot be
    return list({one.name: one for one in found}.values())  # one that is named twice counts once


def limits_of(name: str) -> "MotionLimits":
    """Limits of moves, gentle or industrial."""
    from tvist_lab.study.case import LIMITS

    if name not in LIMITS:
        raise Failure(f"limits is {name!r}: must be {' or '.join(LIMITS)}", code=2)
    return LIMITS[name]

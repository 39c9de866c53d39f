"""Figures of what logs tell, each over hidden robots, beside what they should be."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proof.logs.everyday import Unseen, everyday_logs, unseen
from tvist_controller.api.line import body
from tvist_lab.identification.from_logs import identify_from_logs
from tvist_lab.identification.twin import fit_twin
from tvist_lab.identification.unknowns import SURE
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm

PLACES = 60
"""Number of unseen postures of each robot."""
ASKED = {
    "f_d_within_5_percent": "at least 95",
    "zeta_within_20_percent": "at least 95",
    "f_d_interval_holds_percent": "90 to 99",
    "zeta_interval_holds_percent": "90 to 99",
    "twin_f_d_within_3_percent": "at least 95",
    "twin_residual_error_percent": "at most 20",
    "twin_residual_error_p90_percent": "at most 40",
}
"""What is asked of the figures over all robots [%]."""
OTHERS = 5000
"""What is added to the seed for motions that are not fitted."""


def report(
    robots: Sequence[str], hidden: Sequence[int], seed: int, tell: Callable[[str], None], *, twins: bool
) -> dict[str, Any]:
    """Identify hidden robots from twenty everyday motions each, fit a twin of each, and judge both.

    Args:
        robots: Names of robot files.
        hidden: Seeds of the hidden robots of each.
        seed: Seed of motions and noise.
        tell: Called with what is done.
        twins: Whether to fit twins, which takes minutes for each robot.
    """
    rows = []
    for robot in robots:
        for number in hidden:
            tell(f"{robot}, hidden {number}")
            rows.append(_row(robot, number, seed, tell, twins=twins))
    keys = [key for key in rows[0] if key not in ("robot", "hidden", "stops")]
    whole = {key: float(np.mean([row[key] for row in rows])) for key in keys}
    return {"robots": rows, "mean": whole}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the figures as a table: a row for each, a column for each robot."""
    rows = result["robots"]
    names = [f"{row['robot']} {row['hidden']}" for row in rows]
    lines = [
        [key, *(f"{row[key]:.1f}" for row in rows), f"{value:.1f}", ASKED.get(key, "")]
        for key, value in result["mean"].items()
    ]
    return [(["figure", *names, "mean", "asked"], lines)]


def _row(robot: str, hidden: int, seed: int, tell: Callable[[str], None], *, twins: bool) -> dict[str, Any]:
    description = load(robot)
    logs = asyncio.run(everyday_logs(robot, hidden, seed))
    found = identify_from_logs(description, logs, name="everyday", command="proof logs", progress=tell)
    places = list(unseen(description, hidden, PLACES, seed))
    errors = []
    for place in places:
        known = found.forecast.at(place.q, found.forecast.arm.payloads.index(place.declared), 3)
        k = int(np.argmin(np.abs(known.f_d - place.ring.f_d)))
        f_d, zeta = np.log(known.f_d[k] / place.ring.f_d), np.log(known.zeta[k] / place.ring.zeta)
        errors.append((f_d, zeta, known.f_d_error[k], known.zeta_error[k], _linear(place, known.f_d[0])))
    f_d, zeta, f_d_error, zeta_error, linear = np.abs(np.array(errors)).T
    row: dict[str, Any] = {
        "robot": robot,
        "hidden": hidden,
        "stops": found.used,
        "f_d_within_5_percent": _share(f_d < 0.05),
        "zeta_within_20_percent": _share(zeta < 0.2),
        "f_d_interval_holds_percent": _share(f_d < SURE * f_d_error),
        "zeta_interval_holds_percent": _share(zeta < SURE * zeta_error),
        "f_d_median_percent": 100.0 * float(np.median(f_d)),
        "zeta_median_percent": 100.0 * float(np.median(zeta)),
        "f_d_interval_percent": 100.0 * SURE * float(np.median(f_d_error)),
        "zeta_interval_percent": 100.0 * SURE * float(np.median(zeta_error)),
        "linear_f_d_within_5_percent": _share(linear < 0.05),
    }
    if not twins:
        return row
    checks = asyncio.run(everyday_logs(robot, hidden, seed + OTHERS))
    twin = fit_twin(description, logs, checks, tell)
    ratios = []
    for place in places:
        index = twin.parameters.payloads.index(place.declared)
        carried = body(twin.parameters.payload(twin.values, index))
        arm = FlexibleArm(twin.parameters.robot(twin.values, index), carried)
        ratios.append(_linear(place, float(arm.modes(place.q).f_d[0])))
    twin_f_d = np.abs(ratios)
    return row | {
        "twin_f_d_within_3_percent": _share(twin_f_d < 0.03),
        "twin_f_d_median_percent": 100.0 * float(np.median(twin_f_d)),
        "twin_residual_error_percent": twin.error_percent(0.5),
        "twin_residual_error_p90_percent": twin.error_percent(0.9),
    }


def _linear(place: Unseen, f_d: float) -> float:
    return float(np.log(f_d / place.linear.f_d[0]))


def _share(holds: Any) -> float:
    return 100.0 * float(np.mean(holds))

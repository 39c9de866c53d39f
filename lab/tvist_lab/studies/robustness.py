"""Reduction of vibration by each method on arms other than calibrated, or that carry more or less than declared."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvist_lab.study.arms import AS_DESCRIBED, PERTURBED, with_springs
from tvist_lab.study.case import Case
from tvist_lab.study.held_out import intervals, median_and_p5
from tvist_lab.study.measures import QUIET, WORTH
from tvist_lab.study.method import Method
from tvist_lab.study.moves import Move
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import Job, Row
from tvist_plant.description import RobotDescription
from tvist_plant.variants import Variant, hidden_variant, variant

ERRORS: dict[str, tuple[float, ...]] = {
    "stiffness": (0.0, 0.05, -0.05, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3),
    "payload": (0.0, 0.1, -0.1, 0.2, -0.2),
}
"""Relative errors [-]: by which all springs of the arm are stiffer than calibrated, and by which the declared mass
exceeds the carried one.
"""
PLANT = "plant"
"""Kind of what is wrong with a plant that has a name."""
WANTED = ("unshaped_peak_m_s2", "shaped_peak_m_s2", "waited_peak_m_s2", "delay_ms")
"""Measures of each motion."""
FIRST = (Shown("shaper", "name"), Shown("delay ms", "delay_ms", 0))
"""First columns of all tables."""


Columns = Mapping[str, Mapping[str, tuple[Variant, float]]]
"""The columns of each kind of table by their titles: the arm, and the error of the declared mass [-]."""


def columns(hidden: Sequence[int] = ()) -> Columns:
    """Return the columns of all tables, each in the order of the errors.

    Args:
        hidden: Seeds of hidden robots that are plants, too.
    """

    def titled(kind: str) -> dict[str, float]:
        return {f"{100.0 * error:+.0f} %": error for error in sorted(ERRORS[kind])}

    plants = [*map(variant, PERTURBED), *map(hidden_variant, hidden)]
    return {
        "stiffness": {
            title: (with_springs(1.0 + error), 0.0) for title, error in titled("stiffness").items()
        },
        "payload": {title: (AS_DESCRIBED, error) for title, error in titled("payload").items()},
        PLANT: {one.name: (one, 0.0) for one in plants},
    }


def jobs(
    description: RobotDescription,
    methods: Sequence[Method],
    moves: Sequence[Move],
    seed: int,
    hidden: Sequence[int] = (),
) -> list[Job]:
    """Return all jobs: error of the payload by move, each by all methods on all arms with that error."""
    arms: dict[float, dict[str, Variant]] = {}
    for kind in columns(hidden).values():
        for arm, error in kind.values():
            arms.setdefault(error, {})[arm.name] = arm
    return [
        Job(
            Case(
                description,
                move,
                seed + number,
                tuple(those.values()),
                payload_error=error,
                axes={"payload_error": error},
            ),
            tuple(methods),
            WANTED,
            as_served=False,
        )
        for error, those in arms.items()
        for number, move in enumerate(moves)
    ]


def report(
    methods: Sequence[Method], rows: Sequence[Row], hidden: Sequence[int] = ()
) -> list[dict[str, Any]]:
    """Return one entry for each method, ordered by delay; moves without vibration do not count."""
    every = columns(hidden)
    entries = [
        _entry(method, [row for row in rows if row["shaper"] == method.name], every) for method in methods
    ]
    return sorted(entries, key=lambda entry: (entry["delay_ms"], entry["name"]))


def _entry(method: Method, rows: Sequence[Row], every: Columns) -> dict[str, Any]:
    cells: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        if row["unshaped_peak_m_s2"] >= WORTH:
            cells.setdefault((row["arm"], row["payload_error"]), []).append(row)
    return {
        "name": method.name,
        "label": method.label,
        "told_target": method.told_target,
        "delay_ms": round(float(np.median([row["delay_ms"] for row in rows])), 6),
        **{
            kind: {
                title: _reductions(cells.get((arm.name, error), [])) for title, (arm, error) in those.items()
            }
            for kind, those in every.items()
        },
    }


def _reductions(rows: Sequence[Row]) -> dict[str, Any]:
    # Where waiting alone is enough, there is nothing to gain beyond it.
    waited = [row for row in rows if row["waited_peak_m_s2"] >= QUIET]
    less = np.array([_less(row["shaped_peak_m_s2"], row["unshaped_peak_m_s2"]) for row in rows])
    return {
        "moves": len(rows),
        "reduction_percent": median_and_p5(less),
        "reduction_percent_interval": intervals(less),
        "beyond_waiting_percent": median_and_p5(
            [_less(row["shaped_peak_m_s2"], row["waited_peak_m_s2"]) for row in waited]
        ),
    }


def _less(peak: float, before: float) -> float:
    return 100.0 * (1.0 - peak / before)


def on_terminal(hidden: Sequence[int] = ()) -> dict[str, list[Shown]]:
    """Columns of the tables of a terminal, by their titles, each with median and 5th percentile."""

    def both(kind: str, title: str) -> Shown:
        one, other = (Shown("", f"{kind}.{title}.reduction_percent.{share}", 1) for share in ("median", "p5"))
        return Shown(title, lambda entry: f"{one.text(entry)} / {other.text(entry)}")

    return {
        kind: [*FIRST, *(both(kind, title) for title in those)] for kind, those in columns(hidden).items()
    }

"""Reduction of vibration by each method on arms that are stiffer or softer, or carry more or less, than declared."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tvist_lab.studies.evaluate import percentiles
from tvist_lab.study.arms import with_springs
from tvist_lab.study.case import Case
from tvist_lab.study.measures import QUIET, WORTH
from tvist_lab.study.method import Method
from tvist_lab.study.moves import Move
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import Job, Row
from tvist_plant.description import RobotDescription

ERRORS: dict[str, tuple[float, ...]] = {
    "stiffness": (0.0, 0.05, -0.05, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3),
    "payload": (0.0, 0.1, -0.1, 0.2, -0.2),
}
"""Relative errors [-]: by which all springs of the arm are stiffer than calibrated, and by which the declared mass
exceeds the carried one.
"""
PERCENTILES = {"median": 50.0, "p5": 5.0}
"""Percentiles over moves."""
WANTED = ("unshaped_peak_m_s2", "shaped_peak_m_s2", "waited_peak_m_s2", "delay_ms")
"""Measures of each motion."""
FIRST = (Shown("shaper", "name"), Shown("delay ms", "delay_ms", 0))
"""First columns of all tables."""


def jobs(
    description: RobotDescription, methods: Sequence[Method], moves: Sequence[Move], seed: int
) -> list[Job]:
    """Return all jobs: kind of error by size by move, each by all methods."""
    return [
        Job(
            Case(
                description,
                move,
                seed + number,
                arms=(with_springs(1.0 + (error if kind == "stiffness" else 0.0)),),
                payload_error=error if kind == "payload" else 0.0,
                axes={"kind": kind, "error": error},
            ),
            tuple(methods),
            WANTED,
            as_served=False,
        )
        for kind, errors in ERRORS.items()
        for error in errors
        for number, move in enumerate(moves)
    ]


def report(methods: Sequence[Method], rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return one entry for each method, ordered by delay; moves without vibration do not count."""
    entries = [_entry(method, [row for row in rows if row["shaper"] == method.name]) for method in methods]
    return sorted(entries, key=lambda entry: (entry["delay_ms"], entry["name"]))


def _entry(method: Method, rows: Sequence[Row]) -> dict[str, Any]:
    counted = [row for row in rows if row["unshaped_peak_m_s2"] >= WORTH]
    return {
        "name": method.name,
        "label": method.label,
        "told_target": method.told_target,
        "delay_ms": round(float(np.median([row["delay_ms"] for row in rows])), 6),
        **{
            kind: {
                f"{100.0 * error:+.0f} %": _reductions(
                    [row for row in counted if (row["kind"], row["error"]) == (kind, error)]
                )
                for error in errors
            }
            for kind, errors in ERRORS.items()
        },
    }


def _reductions(rows: Sequence[Row]) -> dict[str, Any]:
    return {
        "moves": len(rows),
        "reduction_percent": percentiles(
            [_less(row["shaped_peak_m_s2"], row["unshaped_peak_m_s2"]) for row in rows], **PERCENTILES
        ),
        # Where waiting alone is enough, there is nothing to gain beyond it.
        "beyond_waiting_percent": percentiles(
            [
                _less(row["shaped_peak_m_s2"], row["waited_peak_m_s2"])
                for row in rows
                if row["waited_peak_m_s2"] >= QUIET
            ],
            **PERCENTILES,
        ),
    }


def _less(peak: float, before: float) -> float:
    return 100.0 * (1.0 - peak / before)


def tables() -> dict[str, list[Shown]]:
    """Columns of the tables of a page, by their titles."""
    return {
        f"{kind}: {share}": [
            *FIRST, *(Shown(error, f"{kind}.{error}.reduction_percent.{share}", 1) for error in _errors(kind)),
        ]
        for kind in ERRORS
        for share in PERCENTILES
    }  # fmt: skip


def on_terminal(kind: str) -> list[Shown]:
    """Columns of the table of a kind of error, each with median and 5th percentile."""

    def both(error: str) -> Shown:
        one, other = (Shown("", f"{kind}.{error}.reduction_percent.{share}", 1) for share in PERCENTILES)
        return Shown(error, lambda entry: f"{one.text(entry)} / {other.text(entry)}")

    return [*FIRST, *map(both, _errors(kind))]


def _errors(kind: str) -> list[str]:
    """Errors of a kind in words, the smallest first."""
    return [f"{100.0 * error:+.0f} %" for error in sorted(ERRORS[kind])]

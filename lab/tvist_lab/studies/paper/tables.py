"""Rows of Table 2 beside the paper's, and of a table of all methods."""

from collections.abc import Sequence
from typing import Any

from tvist_lab.studies.paper.published import published
from tvist_lab.study.columns import Column, cells

FIGURES = ("delay ms", "stabilisation ms", "cycle ms", "overshoot m", "RV m/s²")
"""Headings of the figures of Table 2."""
IMPACTS = ("stabilisation", "cycle", "overshoot", "residual_vibration")
"""What shaping changes, in the order of these figures."""
METHODS = (
    Column("method", "label"), Column("delay ms", "delay_ms", 0), Column("RV m/s²", "residual_vibration_m_s2", 3),
    Column("peak m/s²", "peak_m_s2", 3), Column("less peak %", "peak_reduction_percent", 1),
    Column("still after ms", "still_after_ms", 0), Column("peak q̈ / limit", "peak_acceleration_ratio", 3),
)  # fmt: skip
"""Columns of a table of methods."""


def table_2(table: dict[str, Any], digits: int) -> list[tuple[str, ...]]:
    """Return the rows of Table 2: the motion, what is shown and whose it is, and the figures.

    Args:
        table: Table 2 of `report.as_dict`.
        digits: Decimals of the residual vibration.
    """
    forms = {
        "delay_ms": ".1f", "stabilisation_ms": ".1f", "cycle_ms": ".1f", "overshoot_m": ".1e",
        "residual_vibration_m_s2": f".{digits}f",
    }  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for motion, ours in table.items():
        both = (("paper", published()["table_2"][motion]), ("here", ours))
        for kind in ("unshaped", "shaped"):
            for who, source in both:
                figures = (_form(source[kind][key], form) for key, form in forms.items())
                rows.append((motion, f"{kind}, {who}", *figures))
        for who, source in both:
            percents = (_form(source["impact_percent"][key], "+.1f", " %") for key in IMPACTS)
            rows.append((motion, f"impact, {who}", "", *percents))
    return rows


def methods(result: dict[str, Any], motion: str, first: str) -> list[tuple[str, ...]]:
    """Return the rows of a table of methods.

    Args:
        result: Result of `report.as_dict`.
        motion: The motion.
        first: How the method that is still first is written, such as "**{}**".
    """
    rows = result["baselines"][motion]
    known = [row["still_after_ms"] for row in rows.values() if row["still_after_ms"] is not None]
    soonest = min(known, default=None)

    def label(name: str) -> str:
        said = "waiting, unshaped" if name == "unshaped" else str(result["methods"][name])
        return first.format(said) if rows[name]["still_after_ms"] == soonest else said

    return cells([{"label": label(name), **row} for name, row in rows.items()], METHODS)


def beside(arms: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Return heading and rows of the table of the origins, with the paper's figures and those of each arm.

    Args:
        arms: Result of `report.as_dict` for each arm.
    """
    heading = ("figure", "paper", *(title for one in arms for title in (one["robot"], "origin")))
    rows = zip(*(one["origins"] for one in arms), strict=True)
    return [heading, *(
        (same[0]["figure"], same[0]["paper"], *(row[key] for row in same for key in ("here", "origin")))
        for same in rows
    )]  # fmt: skip


def _form(value: float | None, form: str, unit: str = "") -> str:
    return "–" if value is None else f"{value:{form}}{unit}"

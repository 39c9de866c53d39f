"""The experiment as a page of the documentation."""

from typing import Any

from tvist_lab.markdown_table import markdown_table
from tvist_lab.studies.pages import page
from tvist_lab.studies.paper.origins import MEANINGS, origins
from tvist_lab.studies.paper.published import published

COLUMNS = {
    "delay_ms": ("delay ms", "{:.1f}"),
    "stabilisation_ms": ("stabilisation ms", "{:.1f}"),
    "cycle_ms": ("cycle ms", "{:.1f}"),
    "overshoot_m": ("overshoot m", "{:.1e}"),
    "residual_vibration_m_s2": ("RV m/s²", "{:.2f}"),
}
METHOD_COLUMNS = {
    "delay_ms": ("delay ms", "{:.0f}"),
    "residual_vibration_m_s2": ("RV m/s²", "{:.3f}"),
    "peak_m_s2": ("peak m/s²", "{:.3f}"),
    "peak_reduction_percent": ("less peak %", "{:.1f}"),
    "still_after_ms": ("still after ms", "{:.0f}"),
    "peak_acceleration_ratio": ("peak q̈ / limit", "{:.3f}"),
}


def page_of(result: dict[str, Any], command: str) -> str:
    """Return Tables 1 and 2 beside the paper's, the baselines, and the origin of each figure."""
    return page(
        "paper",
        result,
        command,
        second=_table_2(result["table_2"]),
        methods_of={motion: _methods(result, rows) for motion, rows in result["baselines"].items()},
        meanings=MEANINGS,
        origins=markdown_table(("figure", "paper", "here", "origin", "remark"), origins(result)),
    )


def _table_2(table: dict[str, Any]) -> str:
    rows = []
    for motion, ours in table.items():
        paper = published()["table_2"][motion]
        for kind in ("unshaped", "shaped"):
            for who, source in (("paper", paper), ("here", ours)):
                values = (_form(source[kind][key], form) for key, (_, form) in COLUMNS.items())
                rows.append((motion, f"{kind}, {who}", *values))
        for who, source in (("paper", paper), ("here", ours)):
            impact = source["impact_percent"]
            percents = (
                _form(impact[key], "{:+.1f} %")
                for key in ("stabilisation", "cycle", "overshoot", "residual_vibration")
            )
            rows.append((motion, f"impact, {who}", "", *percents))
    return markdown_table(("motion", "", *(name for name, _ in COLUMNS.values())), rows)


def _methods(result: dict[str, Any], rows: dict[str, dict[str, float | None]]) -> str:
    first = min(
        (row["still_after_ms"] for row in rows.values() if row["still_after_ms"] is not None), default=None
    )
    lines = []
    for name, row in rows.items():
        label = "waiting, unshaped" if name == "unshaped" else result["methods"][name]
        values = (_form(row[key], form) for key, (_, form) in METHOD_COLUMNS.items())
        lines.append((f"**{label}**" if row["still_after_ms"] == first else label, *values))
    return markdown_table(("method", *(name for name, _ in METHOD_COLUMNS.values())), lines)


def _form(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)

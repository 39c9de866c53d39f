"""The experiment as a page of the documentation."""

from typing import Any

from tvist_lab.markdown_table import markdown_table
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


RV = """\
RV is measured as in the paper, by an exponential through the peaks of the tool's acceleration after the stop. After
shaping there are often fewer than two peaks. RV is then the largest value; sensor noise of 0.03 m/s² per axis alone
raises this to about 0.1."""
COMMON_CLOCK = """\
Times are measured from the start of the unshaped reference. The peak is that of the true acceleration (without noise)
from 10 ms after the reference's own stop. The arm is still when the true acceleration of the tool stays below 0.1 m/s².
The method that is still first is in bold."""


def page(result: dict[str, Any], command: str) -> str:
    """Return Tables 1 and 2 beside the paper's, the baselines, and the origin of each figure."""
    made = (
        f"This page was made by `{command}`; do not edit it. Each motion was simulated {result['runs']} times, each "
        f"time with other noise and gear errors, with seed {result['seed']} and calibration `{result['calibration']}`. "
        "The paper is Thomsen et al., ICINCO 2019, doi 10.5220/0007834504880498."
    )
    parts = [
        "# The paper's experiment in this simulation",
        made,
        "## Table 2, ours and the paper's",
        _table_2(result["table_2"]),
        RV,
        "## Every method on a common clock",
        COMMON_CLOCK,
        *(
            part
            for motion, rows in result["baselines"].items()
            for part in (f"### {motion}", _methods(result, rows))
        ),
        "## Origin of each figure",
        *(f"- **{word}**: {meaning}" for word, meaning in MEANINGS.items()),
        markdown_table(("figure", "paper", "here", "origin", "remark"), origins(result)),
    ]
    return "\n\n".join(parts).replace("\n\n- **", "\n- **") + "\n"


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

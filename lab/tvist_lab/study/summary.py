"""Rows in short: an entry for each setting and method, over all moves; and that of a sweep."""

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from tvist_lab.study.columns import AXES
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import FAILED, MEASURED, TOO_WEAK

Shares = Mapping[str, float]
"""Names of percentiles, as shares [-]."""

STATUS = pl.col("status")
COUNTED = {
    "moves": pl.len(),
    "measured": (STATUS == MEASURED).sum(),
    "counted": pl.col("reduction_percent").is_not_null().sum(),
    "too_weak": (STATUS == TOO_WEAK).sum(),
    "failed": (STATUS == FAILED).sum(),
    "never_still": ((STATUS == MEASURED) & pl.col("shaped_still_after_ms").is_null()).sum(),
}
"""What is counted of each setting of a sweep."""
FIGURES: Mapping[str, Shares] = {
    "reduction_percent": {"median": 0.5, "p5": 0.05},
    "less_than_waiting_percent": {"median": 0.5},
    "delay_ms": {"median": 0.5, "max": 1.0},
    "still_after_unshaped_stop_ms": {"median": 0.5, "p90": 0.9},
    "peak_acceleration_ratio": {"max": 1.0},
}
"""What is summarized of each setting of a sweep."""
SHOWN = (
    Shown("setting", "setting"), Shown("shaper", "shaper"), Shown("moves", "measured"),
    Shown("delay ms", "delay_ms.median", 0), Shown("less %", "reduction_percent.median", 1),
    Shown("p5", "reduction_percent.p5", 1), Shown("than waiting", "less_than_waiting_percent.median", 1),
    Shown("still ms", "still_after_unshaped_stop_ms.median", 0), Shown("p90", "still_after_unshaped_stop_ms.p90", 0),
    Shown("q̈/limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
"""Table of a summary, whose entries have got the name of their setting."""


def summarized(
    rows: pl.DataFrame, keys: Sequence[str], counted: Mapping[str, pl.Expr], figures: Mapping[str, Shares]
) -> list[dict[str, Any]]:
    """Return an entry for each combination of keys, in the order of the rows.

    Args:
        rows: Rows of a study.
        keys: Columns that together distinguish what is summarized.
        counted: Numbers of an entry by name.
        figures: Percentiles of an entry by measure, over the rows that were measured and have it.
    """
    asked = {
        f"{name}.{share}": pl.col(name).filter(STATUS == MEASURED).quantile(value, "linear")
        for name, shares in figures.items()
        for share, value in shares.items()
    }
    grouped = rows.group_by(keys, maintain_order=True).agg(**counted, **asked)
    return [
        {name: row[name] for name in (*keys, *counted)}
        | {name: {share: row[f"{name}.{share}"] for share in shares} for name, shares in figures.items()}
        for row in grouped.iter_rows(named=True)
    ]


def summary(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Return an entry for each combination of a sweep's axes, in the order of the rows.

    Percentiles of reductions are over the moves whose unshaped peak is worth a percentage, others over all measured.
    """
    late = pl.col("shaped_still_after_ms") - pl.col("unshaped_duration_ms")
    return summarized(rows.with_columns(still_after_unshaped_stop_ms=late), AXES, COUNTED, FIGURES)


def setting_name(entry: dict[str, Any]) -> str:
    """Return robot, payload and errors of an entry or a row as text, such as "ur5e, 2.5 kg, payload +10 %"."""
    carried = entry["payload"]
    names = [entry["robot"], carried if carried == "uniform" else f"{carried} kg"]
    for kind, sign in (("payload", "+"), ("stiffness", ""), ("frequency", "+")):
        error = entry[f"{kind}_error_percent"]
        if error:
            names.append(f"{kind} {'±' if not sign else ''}{error:{sign}g} %")
    return ", ".join(names)

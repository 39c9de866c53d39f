"""A sweep in short: one entry for each robot, payload, error and shaper, over all moves."""

from typing import Any

import polars as pl

from tvist_lab.study.columns import AXES
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import FAILED, MEASURED, TOO_WEAK

SHOWN = (
    Shown("setting", "setting"), Shown("shaper", "shaper"), Shown("moves", "measured"),
    Shown("delay ms", "delay_ms.median", 0), Shown("less %", "reduction_percent.median", 1),
    Shown("p5", "reduction_percent.p5", 1), Shown("than waiting", "less_than_waiting_percent.median", 1),
    Shown("still ms", "still_after_unshaped_stop_ms.median", 0), Shown("p90", "still_after_unshaped_stop_ms.p90", 0),
    Shown("q̈/limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
"""Table of a summary, whose entries have got the name of their setting."""


def summary(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Return an entry for each combination of the axes, in the order of the rows.

    Percentiles of reductions are over the moves whose unshaped peak is worth a percentage, others over all measured.
    """
    measured = pl.col("status") == MEASURED

    def at(name: str, share: float) -> pl.Expr:
        return pl.col(name).filter(measured).quantile(share, "linear")

    late = pl.col("shaped_still_after_ms") - pl.col("unshaped_duration_ms")
    grouped = rows.group_by(AXES, maintain_order=True).agg(
        moves=pl.len(),
        measured=measured.sum(),
        counted=pl.col("reduction_percent").is_not_null().sum(),
        too_weak=(pl.col("status") == TOO_WEAK).sum(),
        failed=(pl.col("status") == FAILED).sum(),
        reduction_median=at("reduction_percent", 0.5),
        reduction_p5=at("reduction_percent", 0.05),
        waiting_median=at("less_than_waiting_percent", 0.5),
        delay_median=at("delay_ms", 0.5),
        delay_max=at("delay_ms", 1.0),
        still_median=late.filter(measured).quantile(0.5, "linear"),
        still_p90=late.filter(measured).quantile(0.9, "linear"),
        never_still=(measured & pl.col("shaped_still_after_ms").is_null()).sum(),
        acceleration_max=at("peak_acceleration_ratio", 1.0),
    )
    return [_entry(row) for row in grouped.iter_rows(named=True)]


def _entry(row: dict[str, Any]) -> dict[str, Any]:
    return {
        **{name: row[name] for name in (*AXES, "moves", "measured", "counted", "too_weak", "failed")},
        "reduction_percent": {"median": row["reduction_median"], "p5": row["reduction_p5"]},
        "less_than_waiting_percent": {"median": row["waiting_median"]},
        "delay_ms": {"median": row["delay_median"], "max": row["delay_max"]},
        "still_after_unshaped_stop_ms": {"median": row["still_median"], "p90": row["still_p90"]},
        "never_still": row["never_still"],
        "peak_acceleration_ratio": {"max": row["acceleration_max"]},
    }


def setting_name(entry: dict[str, Any]) -> str:
    """Return robot, payload and errors of an entry or a row as text, such as "ur5e, 2.5 kg, payload +10 %"."""
    carried = entry["payload"]
    names = [entry["robot"], carried if carried == "uniform" else f"{carried} kg"]
    for kind, sign in (("payload", "+"), ("stiffness", ""), ("frequency", "+")):
        error = entry[f"{kind}_error_percent"]
        if error:
            names.append(f"{kind} {'±' if not sign else ''}{error:{sign}g} %")
    return ", ".join(names)

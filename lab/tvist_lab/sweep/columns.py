"""The columns of a sweep's rows: names, types, units and meanings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

MEASURED, TOO_WEAK, FAILED = "measured", "too weak", "failed"
"""What became of a row."""


@dataclass(frozen=True)
class Column:
    """A column."""

    name: str
    kind: Any
    """Its type in polars."""
    unit: str
    """Its unit; empty for text and counts."""
    meaning: str


COLUMNS = (
    Column("row", pl.Int64, "", "position of the row, from 0 on"),
    Column("robot", pl.String, "", "robot, as the spec names it"),
    Column("payload", pl.String, "", "payload, as the spec says it: a mass in kg, or uniform"),
    Column("payload_error_percent", pl.Float64, "%", "excess of the declared mass over the carried one"),
    Column(
        "stiffness_error_percent", pl.Float64, "%",
        "deviation of springs and velocity loops, up or down at random",
    ),
    Column("frequency_error_percent", pl.Float64, "%", "excess of the controller's frequencies"),
    Column("move", pl.Int64, "", "number of the random move of this robot, from 1 on"),
    Column("shaper", pl.String, "", "shaper, as the spec names it"),
    Column("seed", pl.Int64, "", "seed of gear errors and deviations, equal for equal `move`"),
    Column("payload_kg", pl.Float64, "kg", "carried mass"),
    Column("start", pl.List(pl.Float64), "rad", "joint angles at the start"),
    Column("target", pl.List(pl.Float64), "rad", "joint angles at the end"),
    Column("status", pl.String, "", "`measured`; `too weak` if the drives cannot make the move; or `failed`"),
    Column(
        "unshaped_peak_m_s2", pl.Float64, "m/s²",
        "largest acceleration of the unshaped tool later than 10 ms after its stop",
    ),
    Column("shaped_peak_m_s2", pl.Float64, "m/s²", "the same of the shaped tool, after its own stop"),
    Column(
        "reduction_percent", pl.Float64, "%",
        "reduction of the peak; null if the unshaped peak is below 0.2 m/s²",
    ),
    Column("less_than_waiting_percent", pl.Float64, "%", "the same, compared with waiting until the shaped stop"),
    Column("delay_ms", pl.Float64, "ms", "how much later the shaped reference ends"),
    Column("unshaped_duration_ms", pl.Float64, "ms", "duration of the unshaped reference"),
    Column(
        "unshaped_still_after_ms", pl.Float64, "ms",
        "time until the unshaped tool stays below 0.1 m/s²; null if it does not",
    ),
    Column(
        "shaped_still_after_ms", pl.Float64, "ms",
        "the same of the shaped tool, from the start of the unshaped reference",
    ),
    Column("peak_acceleration_ratio", pl.Float64, "–", "largest shaped q̈ relative to the limit"),
    Column("peak_velocity_ratio", pl.Float64, "–", "largest shaped q̇ relative to the limit"),
    Column("error", pl.String, "", "why a row that is not `measured` is not; null otherwise"),
)  # fmt: skip
"""All columns, in their order."""

SCHEMA = {column.name: column.kind for column in COLUMNS}
"""Types of the columns."""
AXES = (
    "robot",
    "payload",
    "payload_error_percent",
    "stiffness_error_percent",
    "frequency_error_percent",
    "shaper",
)
"""Columns that together distinguish what is summarized."""

Row = dict[str, Any]
"""A row: a value, or None, by the name of its column."""


def frame(rows: Sequence[Row]) -> pl.DataFrame:
    """Return rows as a table with all columns; what a row lacks is null."""
    return pl.DataFrame(rows, schema=SCHEMA, orient="row")

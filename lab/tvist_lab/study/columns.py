"""The columns of a study's rows: names, types, units and meanings."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from tvist_lab.study.measures import MEASURES, OF_PEAKS
from tvist_lab.study.work import Row


@dataclass(frozen=True)
class Column:
    """A column."""

    name: str
    kind: Any
    """Its type in polars."""
    unit: str
    """Its unit; empty for text and counts."""
    meaning: str


ROW = Column("row", pl.Int64, "", "position of the row, from 0 on")
STATUS = Column(
    "status", pl.String, "", "`measured`; `too weak` if the drives cannot make the move; or `failed`"
)
ERROR = Column("error", pl.String, "", "why a row that is not `measured` is not; null otherwise")
_KINDS: Mapping[type, Any] = {bool: pl.Boolean, int: pl.Int64, float: pl.Float64, str: pl.String}

Schema = Mapping[str, Any]
"""Types of the columns by name, in their order."""


def columns_of(axes: Sequence[Column], measures: Iterable[str]) -> tuple[Column, ...]:
    """Return the columns of rows with these axes and measures."""
    figures = (MEASURES[name] for name in measures)
    return (
        ROW, *axes, STATUS,
        *(Column(one.name, pl.Float64, one.unit, one.meaning) for one in figures), ERROR,
    )  # fmt: skip


def column_of(name: str, values: Iterable[object]) -> Column:
    """Return the column of an axis by its values, whole numbers and others among them as the others.

    Raises:
        ValueError: Its values have different types.
    """
    kinds = {type(value) for value in values}
    if kinds == {int, float}:
        kinds = {float}
    if len(kinds) > 1:
        raise ValueError(
            f"axis {name!r} has values of the types {', '.join(sorted(kind.__name__ for kind in kinds))}"
        )
    return Column(name, _KINDS.get(kinds.pop(), pl.String), "", "")


def schema_of(columns: Iterable[Column]) -> Schema:
    """Return the types of columns."""
    return {column.name: column.kind for column in columns}


def frame(rows: Sequence[Row], schema: Schema) -> pl.DataFrame:
    """Return rows as a table with all columns; what a row lacks is null."""
    return pl.DataFrame([{name: row.get(name) for name in schema} for row in rows], schema=dict(schema))


COLUMNS = columns_of(
    (
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
    ),
    OF_PEAKS,
)  # fmt: skip
"""All columns of a sweep, in their order."""
SCHEMA = schema_of(COLUMNS)
"""Types of these columns."""
AXES = (
    "robot", "payload", "payload_error_percent", "stiffness_error_percent", "frequency_error_percent", "shaper",
)  # fmt: skip
"""Columns that together distinguish what is summarized."""

"""The columns of a study's rows: names, types, units and meanings; and rows in short."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from tvist_lab.study.measures import MEASURES
from tvist_lab.study.work import FAILED, MEASURED, TOO_WEAK, Row


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
Shares = Mapping[str, float]
"""Percentiles by name, as shares [-]."""
OF_STATUS = {status: pl.col("status") == status for status in (MEASURED, TOO_WEAK, FAILED)}
"""Whether a row has a status."""


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
        f"{name}.{share}": pl.col(name).filter(OF_STATUS[MEASURED]).quantile(value, "linear")
        for name, shares in figures.items()
        for share, value in shares.items()
    }
    grouped = rows.group_by(keys, maintain_order=True).agg(**counted, **asked)
    return [
        {name: row[name] for name in (*keys, *counted)}
        | {name: {share: row[f"{name}.{share}"] for share in shares} for name, shares in figures.items()}
        for row in grouped.iter_rows(named=True)
    ]

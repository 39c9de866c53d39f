"""Columns of tables on terminals, web pages and in Markdown, and the values that studies compute for them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import polars as pl

from tvist_lab.recordings import Floats

Entry = Mapping[str, Any]  # values by name: a line of a table before formatting


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    title: str  # heading; a second line is small on a web page
    of: str | pl.Expr | Callable[[Entry], Any]
    """Key of the value in an entry, such as "delay_ms" or "less.p5"; or a function of the entry; or an
    expression that computes the value for a group of rows, which is stored in the entry under the
    expression's output name."""
    digits: int | None = None  # number of decimals; None for text
    meaning: str = ""  # meaning of the heading's first line

    def text(self, entry: Entry) -> str:
        """Return the text of an entry's cell; a dash means not measurable."""
        value: Any = entry
        if isinstance(self.of, pl.Expr):
            value = entry[self.of.meta.output_name()]
        elif isinstance(self.of, str):
            for key in self.of.split("."):
                value = value[key]
        else:
            value = self.of(entry)
        if isinstance(value, list):
            return " to ".join(replace(self, of="x").text({"x": one}) for one in value)
        if value is None:
            return "–"
        return str(value) if self.digits is None else f"{value:.{self.digits}f}"


@dataclass(frozen=True)
class ResultTable:
    """Entries, and the columns to show."""

    title: str
    entries: Sequence[Entry]
    columns: Sequence[Column]
    listing: bool = False  # whether it lists single motions, which may be too many to show


def titles(columns: Iterable[Column]) -> tuple[str, ...]:
    """Return the headings of columns."""
    return tuple(column.title for column in columns)


def cells(entries: Iterable[Entry], columns: Sequence[Column]) -> list[tuple[str, ...]]:
    """Return the cells of a table, a row for each entry."""
    return [tuple(column.text(entry) for column in columns) for entry in entries]


def meanings(columns: Iterable[Column]) -> dict[str, str]:
    """Return the meanings of words in headings."""
    return {column.title.partition("\n")[0]: column.meaning for column in columns if column.meaning}


def across(
    entries: Iterable[Entry], line: str, key: str, cell: Column, first: Sequence[Column] = ()
) -> ResultTable:
    """Return a table with a line for each value of `line`, and a column for each value of `key`."""
    lines: dict[Any, dict[str, Entry]] = {}
    for entry in entries:
        lines.setdefault(entry[line], {})[str(entry[key])] = entry

    def of(name: str) -> Column:
        return Column(name, lambda one: cell.text(one["of"][name]) if name in one["of"] else None)

    names = dict.fromkeys(name for one in lines.values() for name in one)
    shown = [{**next(iter(one.values())), "of": one} for one in lines.values()]
    return ResultTable(cell.title, shown, [Column(line, line), *first, *map(of, names)])


def share(name: str, of: float, called: str, least: int = 0, among: pl.Expr | None = None) -> pl.Expr:
    """Return an expression for a quantile of a measure over the rows that have this measure.

    `of` is its share [-], `called` its suffix; fewer than `least` rows give null; `among` selects rows.
    """
    column = pl.col(name) if among is None else pl.col(name).filter(among)
    return pl.when(column.count() >= least).then(column.quantile(of, "linear")).alias(f"{name}_{called}")


def median(name: str) -> pl.Expr:
    """Return an expression for the median."""
    return share(name, 0.5, "median")


def p5(name: str, least: int = 0) -> pl.Expr:
    """Return an expression for the 5th percentile, null for fewer than `least` rows."""
    return share(name, 0.05, "p5", least)


def p90(name: str) -> pl.Expr:
    """Return an expression for the 90th percentile."""
    return share(name, 0.9, "p90")


def lowest(name: str) -> pl.Expr:
    """Return an expression for the smallest value."""
    return pl.col(name).min().alias(f"{name}_min")


def highest(name: str) -> pl.Expr:
    """Return an expression for the largest value."""
    return pl.col(name).max().alias(f"{name}_max")


def of_group(function: Callable[..., Any], columns: Sequence[pl.Expr], kind: Any, called: str) -> pl.Expr:
    """Return an expression calling a function with a group's values in some columns, without rows with null.

    The function gets one array per column, of equal length, and returns a value of type `kind`, or None;
    `called` names it.
    """

    def call(series: Sequence[pl.Series]) -> pl.Series:
        whole = pl.DataFrame({str(place): one for place, one in enumerate(series)}).drop_nulls()
        arrays: list[Floats] = [one.to_numpy() for one in whole.iter_columns()]
        return pl.Series([function(*arrays)], dtype=kind)

    return pl.map_groups(list(columns), call, return_dtype=kind, returns_scalar=True).alias(called)

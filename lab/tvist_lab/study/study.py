"""A study: cases by methods, computed values, and the content of tables, page and figures."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import polars as pl
from matplotlib.figure import Figure

from tvist_lab.phrases import QUANTILES_FROM
from tvist_lab.study.case import Case
from tvist_lab.study.columns import Column, ResultTable, highest, lowest, median, p5, share
from tvist_lab.study.foreign import run_file
from tvist_lab.study.measures import MEASURES, OF_PEAKS
from tvist_lab.study.method import Method
from tvist_lab.study.work import FAILED, MEASURED, TOO_WEAK, Job, Row

KINDS: Mapping[type, Any] = {
    bool: pl.Boolean, int: pl.Int64, float: pl.Float64, str: pl.String, list: pl.List(pl.Float64),
}  # fmt: skip
"""Column types by the type of an axis's values."""
COUNTS = {"rows": pl.len()} | {
    status.replace(" ", "_"): (pl.col("status") == status).sum() for status in (MEASURED, TOO_WEAK, FAILED)
}  # counts in each group of rows
DIGITS = 3
QUANTILES = {"median": median, "p95": lambda name: share(name, 0.95, "p95")}
EXTREMES = {"least": lowest, "most": highest}
"""Columns of a measure by their names, if there are enough rows for quantiles, and if not."""

Figures = Mapping[str, tuple[Figure, str]]  # figures and captions, by file name without suffix


class StudyError(ValueError):
    """A study cannot be made; the message tells why."""


def columns_of(names: Iterable[str], *, few: bool) -> tuple[Column, ...]:
    """Return columns of the medians and 95th percentiles of measures, or of their extremes for few rows."""
    return tuple(
        Column(f"{name}\n{called}", of(name), DIGITS, meaning=_meaning(name))
        for name in names
        for called, of in (EXTREMES if few else QUANTILES).items()
    )


def _meaning(name: str) -> str:
    if name not in MEASURES:
        raise StudyError(f"{name!r} is no measure: there are {', '.join(MEASURES)}")
    return f"{MEASURES[name].meaning}{f' [{MEASURES[name].unit}]' if MEASURES[name].unit else ''}"


@dataclass(frozen=True)
class Result:
    """A study that was run."""

    study: "Study"
    rows: pl.DataFrame
    values: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study in which every method makes every case."""

    title: str
    cases: Sequence[Case]  # cases, each with the same axes; a case may have its own methods
    methods: Sequence[Method] = ()
    by: tuple[str, ...] = ()
    """Axes that the tables distinguish besides arms and methods; the figure is drawn over the first one.
    Other axes, such as the number of the move, are summarized."""
    pooled: tuple[str, ...] = ()  # "arm" or "shaper" if a line of the tables covers all arms or shapers
    splits: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Further axes for additional summaries, by their names in --json."""
    show: tuple[str, ...] = ("reduction_percent", "delay_ms")
    """Measures in the figure, and in the table if there are no columns."""
    columns: tuple[Column, ...] = ()
    few: tuple[Column, ...] = ()  # columns if too few rows count for a median
    more: tuple[pl.Expr, ...] = ()  # further values of each group of rows, for --json
    measures: tuple[str, ...] = OF_PEAKS  # measures kept in the rows besides those that the columns need
    prepare: Callable[[pl.DataFrame], pl.DataFrame] = lambda rows: rows
    """Transforms all rows before they are grouped."""
    finish: Callable[[Result], None] = lambda _: None  # adds values to a result that no column can compute
    tables: Callable[[Result], Sequence[ResultTable]] | None = None
    """Returns the tables; None for a single table with the summary."""
    draw: Callable[[Result], Figures] | None = None  # None: measures over the first axis
    as_served: bool = True  # whether moves are planned for the shaper, as a robot does
    notes: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)  # properties of the cases, for --json
    identity: Mapping[str, Any] = field(default_factory=dict)
    """Data that determine the rows besides title, facts and version of tvist; stored rows with another
    identity are not continued."""

    @property
    def shown(self) -> tuple[Column, ...]:
        """Columns of the study's table, without those that distinguish the lines."""
        return self.columns or columns_of(self.show, few=False)

    def jobs(self, places: Iterable[int] | None = None) -> Iterator[Job]:
        """Create the jobs of the cases with these indices, by default of all cases."""
        measures = self.measured
        for case in self.cases if places is None else map(self.cases.__getitem__, places):
            yield Job(case, case.methods or tuple(self.methods), measures, self.as_served)

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of all measures that are kept in the rows."""
        return tuple(dict.fromkeys((*self.measures, *(name for name in self._needed() if name in MEASURES))))

    @property
    def schema(self) -> dict[str, Any]:
        """Column types of its rows."""
        axes = {name: _kind_of(name, self.cases) for name in self.cases[0].axes}
        figures = dict.fromkeys(self.measured, pl.Float64)
        texts = dict.fromkeys(("shaper", "arm", "status"), pl.String)
        return {"case": pl.Int64, **axes, **texts, **figures, "error": pl.String}

    @property
    def keys(self) -> list[str]:
        """Names of the columns by which the tables distinguish lines."""
        several = ["arm"] if len(self.cases[0].arms) > 1 else []
        return [name for name in dict.fromkeys((*self.by, *several, "shaper")) if name not in self.pooled]

    def check(self) -> None:
        """Raise StudyError if the study cannot be made."""
        if not self.cases or not (self.methods or self.cases[0].methods):
            raise StudyError("cases or methods is empty: must have at least one of each")
        for place, case in enumerate(self.cases):
            self._check_case(f"cases[{place}]", case)
        for what, names in (("show", self.show), ("measures", self.measures), ("by", self.by)):
            if isinstance(names, str):
                raise StudyError(f"{what} is {names!r}: must be a tuple of names, ({names!r},)")
        if not self.show:
            raise StudyError("show is empty: must name at least one measure")
        taken = {"case", "shaper", "arm", "status", "error", *self.measured}.intersection(self.cases[0].axes)
        if taken:
            raise StudyError(f"axis {min(taken)!r} is the name of another column: give it another name")
        axes = (*self.cases[0].axes, "arm", "shaper")
        for name in self.by:
            if name not in axes:
                raise StudyError(f"{name!r} is no axis: there are {', '.join(axes)}")
        _check_alone([method.name for method in self.methods], "methods")
        self._check_columns()

    def _check_case(self, place: str, case: Case) -> None:
        if set(case.axes) != set(self.cases[0].axes):
            raise StudyError(f"{place} has the axes {sorted(case.axes)}: must be the same for all")
        for limit, value in vars(case.limits).items():
            if not (isinstance(value, int | float) and value > 0.0):
                raise StudyError(f"{place} has the {limit} limit {value!r}: must be a positive number")
        _check_alone([arm.name for arm in case.arms], f"arms of {place}")

    def _check_columns(self) -> None:
        there = self.prepare(self.frame([])).columns
        for name in self._needed():
            if name not in there:
                raise StudyError(
                    f"a column uses {name!r}, which is no measure: there are {', '.join(MEASURES)}"
                )
        entry = (*self.keys, *COUNTS, *self._computed())
        for one in self.shown if self.finish is Study.finish else ():
            if isinstance(one.of, str) and one.of not in entry:
                raise StudyError(f"column {one.title!r} needs an expression, such as median({one.of!r})")

    def determined_by(self) -> dict[str, Any]:
        """Return all data that determine the rows, by their names in messages."""
        return {"title": self.title, **self.facts, **self.identity, "version of tvist": version("tvist")}

    def frame(self, rows: Sequence[Row]) -> pl.DataFrame:
        """Return rows as a table with all columns; missing values are null."""
        schema = self.schema
        return pl.DataFrame([{name: row.get(name) for name in schema} for row in rows], schema=schema)

    def summary(self, rows: pl.DataFrame, *more: str) -> list[dict[str, Any]]:
        """Return an entry for each group of rows that agree in all keys, and in the axes `more`."""
        grouped = self.prepare(rows).group_by([*self.keys, *more], maintain_order=True)
        return grouped.agg(**COUNTS, **self._computed()).to_dicts()

    def _computed(self) -> dict[str, pl.Expr]:
        every = dict.fromkeys((*self.show, *(() if self.columns else self.measures)))
        columns, worst = [*self.shown, *self.few], list[pl.Expr]()
        if self.draw is None:
            columns += [*columns_of(every, few=False), *columns_of(every, few=True)]
            worst += map(p5, every)
        computed = (*(one.of for one in columns if isinstance(one.of, pl.Expr)), *worst, *self.more)
        return {one.meta.output_name(): one for one in computed}

    def _needed(self) -> list[str]:
        return [name for one in self._computed().values() for name in one.meta.root_names()]

    def result(self, rows: pl.DataFrame, about: Mapping[str, Any]) -> Result:
        """Return the result of all rows."""
        values = {
            "title": self.title, **self.facts, **about,
            "methods": described({one.name: one for one in (*self.cases[0].methods, *self.methods)}.values()),
            "arms": {arm.name: arm.label for arm in self.cases[0].arms},
            "summary": self.summary(rows),
            **{name: self.summary(rows, *axes) for name, axes in self.splits.items()},
            "notes": [self.notes] if self.notes else [],
        }  # fmt: skip
        found = Result(self, rows, values)
        self.finish(found)
        return found

    def tables_of(self, result: Result) -> Sequence[ResultTable]:
        """Return the tables that show a result."""
        if self.tables is not None:
            return self.tables(result)
        return [self.table_of(result.values["summary"])]

    def table_of(self, entries: Sequence[dict[str, Any]]) -> ResultTable:
        """Return the table of a summary; with few rows, with extremes instead of medians."""
        many = all(entry.get("counted", entry["rows"]) >= QUANTILES_FROM for entry in entries)
        columns = self.shown if many else self.few or self.columns or columns_of(self.show, few=True)
        return ResultTable("", entries, [*(Column(name, name) for name in self.keys), *columns])


def described(methods: Iterable[Method]) -> list[dict[str, Any]]:
    """Return the entry of each method for --json."""
    return [{"name": one.name, "label": one.label, "told_target": one.needs_target} for one in methods]


def _kind_of(name: str, cases: Iterable[Case]) -> Any:
    """Return the column type of an axis; mixed whole numbers and floats are floats."""
    kinds = {type(case.axes[name]) for case in cases}
    if kinds == {int, float}:
        kinds = {float}
    if len(kinds) > 1:
        raise StudyError(
            f"axis {name!r} has values of the types {', '.join(sorted(kind.__name__ for kind in kinds))}: must be one"
        )
    return KINDS.get(kinds.pop(), pl.String)


def _check_alone(names: Sequence[str], what: str) -> None:
    if len(set(names)) < len(names):
        raise StudyError(f"{what} have the same name: {', '.join(names)}: must differ")


def read_study(path: Path) -> Study:
    """Run a Python file, and return its `STUDY`."""
    content = path.read_bytes()
    found = getattr(run_file(path, "study", StudyError), "STUDY", None)
    if not isinstance(found, Study):
        raise StudyError(f"study {path}: contains no STUDY = Study(...)")
    try:
        found.check()
    except StudyError as error:
        raise StudyError(f"study {path}: {error}") from error
    return replace(found, identity={"contents of its file": sha256(content).hexdigest()})

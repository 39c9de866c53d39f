"""A study of one's own: cases by methods, and what its tables, its page and its figure show."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import polars as pl

from tvist_lab.study.case import Case
from tvist_lab.study.columns import OF_STATUS, Column, Shares, column_of, columns_of, schema_of, summarized
from tvist_lab.study.engine import Plan
from tvist_lab.study.foreign import run_file
from tvist_lab.study.measures import MEASURES, OF_PEAKS
from tvist_lab.study.method import Method
from tvist_lab.study.tables import Shown
from tvist_lab.study.work import FAILED, MEASURED, Job
from tvist_lab.words import counted

SHARES = {"median": 0.5, "p5": 0.05, "p95": 0.95}
ENDS = {"least": 0.0, "most": 1.0}
"""Percentiles of each measure that are summarized."""
DIGITS = 3
"""Decimals of the figures in tables."""


class StudyError(ValueError):
    """A file contains no study that can be made; the message says why."""


@dataclass(frozen=True)
class Study:
    """Every method makes every case."""

    title: str
    cases: Sequence[Case]
    """The cases, each with the same axes."""
    methods: Sequence[Method]
    by: tuple[str, ...] = ()
    """Axes that the tables distinguish; the figure is drawn over the first. The other axes, such as the number of the
    move, are summarized.
    """
    show: tuple[str, ...] = ("reduction_percent", "delay_ms")
    """Measures in tables and in the figure."""
    measures: tuple[str, ...] = OF_PEAKS
    """What else is measured and kept in the rows."""
    as_served: bool = True
    """Whether moves are planned for the shaper as a robot plans them, instead of giving it the same reference."""
    notes: str = ""
    """What a reader should know, in Markdown."""
    file: bytes = field(default=b"", repr=False)
    """Content of the file that defines it."""

    @property
    def measured(self) -> tuple[str, ...]:
        """All that is measured."""
        return tuple(dict.fromkeys((*self.measures, *self.show)))

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of its rows."""
        axes = [column_of(name, [case.axes[name] for case in self.cases]) for name in self.cases[0].axes]
        names = (Column("shaper", pl.String, "", "the method"), Column("arm", pl.String, "", "the arm"))
        return columns_of((*axes, *names), self.measured)

    def check(self) -> None:
        """Check that it can be made.

        Raises:
            StudyError: It has no cases or methods, the cases have different axes, or a name is unknown or not alone.
        """
        if not self.cases or not self.methods:
            raise StudyError("it needs a case and a method at least")
        for place, case in enumerate(self.cases):
            self._check_case(f"cases[{place}]", case)
        for what, names in (("show", self.show), ("measures", self.measures), ("by", self.by)):
            if isinstance(names, str):
                raise StudyError(f"{what} is {names!r}: must be a tuple of names, ({names!r},)")
        if not self.show:
            raise StudyError("show is empty: must name a measure at least")
        taken = {"row", "shaper", "arm", "status", "error", *self.measured}.intersection(self.cases[0].axes)
        if taken:
            raise StudyError(f"axis {min(taken)!r} has the name of another column: give it another one")
        _check_known(self.measured, MEASURES, "measure")
        _check_known(self.by, self.cases[0].axes, "axis")
        _check_alone([method.name for method in self.methods], "methods")
        try:
            _ = self.columns
        except ValueError as error:
            raise StudyError(str(error)) from error

    def _check_case(self, place: str, case: Case) -> None:
        first = self.cases[0]
        if set(case.axes) != set(first.axes):
            raise StudyError(f"{place} has the axes {sorted(case.axes)}: all need the same")
        for limit, value in vars(case.limits).items():
            if not (isinstance(value, int | float) and value > 0.0):
                raise StudyError(f"{place} has the {limit} limit {value!r}: must be a positive number")
        if len(case.arms) != len(first.arms):
            raise StudyError(f"{place} has {counted(len(case.arms), 'arm')}: all need as many")
        _check_alone([arm.name for arm in case.arms], f"arms of {place}")

    def plan(self) -> Plan:
        """Return what the engine runs."""
        methods = tuple(self.methods)
        jobs = [Job(case, methods, self.measured, self.as_served) for case in self.cases]
        identity = {
            "title": self.title,
            "contents of its file": sha256(self.file).hexdigest(),
            "version of tvist": version("tvist"),
        }
        return Plan(jobs, schema_of(self.columns), identity)

    def summary(self, rows: pl.DataFrame, shares: Shares = SHARES) -> list[dict[str, Any]]:
        """Return an entry for each setting, arm and method, over all other axes; `ENDS` is for few rows."""
        keys = [*self.by, *(["arm"] if len(self.cases[0].arms) > 1 else []), "shaper"]
        numbers = {"rows": pl.len(), **{name: OF_STATUS[name].sum() for name in (MEASURED, FAILED)}}
        return summarized(rows, keys, numbers, dict.fromkeys(self.measured, shares))

    def shown(self, entries: Sequence[dict[str, Any]]) -> list[Shown]:
        """Return the columns of its table."""
        keys = [name for name in entries[0] if name not in {"rows", "failed", *self.measured}]
        figures = [
            Shown(f"{name}{'' if share == 'median' else f' {share}'}", f"{name}.{share}", DIGITS)
            for name in self.show
            for share in ("median", "p95", *ENDS)
            if share in entries[0][name]
        ]
        return [*(Shown(name, name) for name in keys), *figures]


def _check_known(names: Iterable[str], known: Iterable[str], what: str) -> None:
    for name in names:
        if name not in known:
            raise StudyError(f"{name!r} is no {what}: there are {', '.join(known)}")


def _check_alone(names: Sequence[str], what: str) -> None:
    if len(set(names)) < len(names):
        raise StudyError(f"{what} have the same name: {', '.join(names)}")


def read_study(path: Path) -> Study:
    """Run a Python file, and return its `STUDY`.

    Raises:
        StudyError: The file cannot be run, or has no study that can be made.
        OSError: The file cannot be read.
    """
    content = path.read_bytes()
    module = run_file(path, "study", StudyError)
    found = getattr(module, "STUDY", None)
    if not isinstance(found, Study):
        raise StudyError(f"study {path}: contains no STUDY = Study(...)")
    try:
        found.check()
    except StudyError as error:
        raise StudyError(f"study {path}: {error}") from error
    return replace(found, file=content)

"""A run of `tvist bench` as JSON, and its comparison with another one."""

import math
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec
from msgspec import Struct

from tvist_lab.benchmark.figure import Figure, Relation
from tvist_lab.benchmark.machine import Machine
from tvist_plant.user_file import UserFileError, read_text

FORMAT: Literal["tvist bench 1"] = "tvist bench 1"


class BenchRun(Struct, frozen=True, kw_only=True):
    """The figures of a run."""

    format: Literal["tvist bench 1"]
    """Format of the file, with its version."""
    seconds: float
    """Duration of each measurement in real time [s]."""
    machine: Machine
    """The machine at the start of the run."""
    figures: dict[str, Figure]
    """The figures by their keys, in the order in which they were measured."""
    details: dict[str, Any] = {}
    """Further figures without a reference, by the names under which the object has them."""


def as_json(run: BenchRun) -> dict[str, Any]:
    """Return a run as one object, in which each key of a figure also leads to its value alone."""
    content: dict[str, Any] = msgspec.to_builtins(run)
    details: dict[str, Any] = content.pop("details")
    return content | details | {key: one.value for key, one in run.figures.items()}


def load_run(path: Path) -> BenchRun:
    """Read a run that `tvist bench --json` printed.

    Raises:
        UserFileError: The file holds no such run.
        OSError: The file does not exist or cannot be read.
    """
    try:
        return msgspec.json.decode(read_text(path, "run of tvist bench"), type=BenchRun)
    except (msgspec.DecodeError, RecursionError) as error:
        raise UserFileError(
            f"{path} is not a run that `tvist bench --json` of this version printed: {error}"
        ) from error


class Change(NamedTuple):
    """One figure in an old and in a new run."""

    key: str
    old: Figure | None
    """None if only the new run has it."""
    new: Figure | None
    """None if only the old run has it."""
    relation: Relation = "ratio"
    """Whether the two comparisons are divided or subtracted."""
    change: float | None = None
    """New ratio divided by the old one, or new difference minus the old one; None if it is not known."""
    low: float | None = None
    """Lower end of the interval of `change`; None if a run has no interval."""
    high: float | None = None
    """Upper end of that interval."""

    @property
    def beyond(self) -> bool | None:
        """Whether the runs differ by more than their intervals explain; None if that is not known."""
        if self.low is None or self.high is None:
            return None
        nothing = 1.0 if self.relation == "ratio" else 0.0
        return not self.low <= nothing <= self.high


def changes(old: BenchRun, new: BenchRun) -> list[Change]:
    """Compare each figure of two runs, those of the new run first.

    What is compared are the figures' relations to their references of the same run, so that the machine's speed cancels
    out.
    """
    keys = [*new.figures, *(key for key in old.figures if key not in new.figures)]
    return [_change(key, old.figures.get(key), new.figures.get(key)) for key in keys]


def _change(key: str, old: Figure | None, new: Figure | None) -> Change:
    """Compare two figures.

    The interval of a difference of two independent estimates a - b, whose own intervals need not be symmetric, is
    a - b - √((a - a_low)² + (b_high - b)²) to a - b + √((a_high - a)² + (b - b_low)²) (Zou and Donner, Statistics in
    Medicine 27, 2008). Ratios are compared by their logarithms.
    """
    if old is None or new is None:
        return Change(key, old, new)
    relation = new.relation
    if old.relation != relation or old.compared is None or new.compared is None:
        return Change(key, old, new, relation)
    ratio = relation == "ratio"
    if ratio and not min(old.compared, new.compared) > 0.0:
        return Change(key, old, new, relation)
    there, back = (math.log, math.exp) if ratio else (float, float)
    a, b = there(new.compared), there(old.compared)
    change = back(a - b)
    ends = new.low, new.high, old.low, old.high
    if any(end is None or (ratio and end <= 0.0) for end in ends):
        return Change(key, old, new, relation, change)
    a_low, a_high, b_low, b_high = (there(end) for end in ends if end is not None)
    down, up = math.hypot(a - a_low, b_high - b), math.hypot(a_high - a, b - b_low)
    return Change(key, old, new, relation, change, back(a - b - down), back(a - b + up))


def changes_as_json(found: list[Change]) -> dict[str, dict[str, float | bool | None]]:
    """Return changes as one object: key of the figure to what was compared, None where a run does not have it."""
    return {
        one.key: {
            "old": None if one.old is None else one.old.compared,
            "new": None if one.new is None else one.new.compared,
            "change": one.change,
            "low": one.low,
            "high": one.high,
            "beyond": one.beyond,
        }
        for one in found
    }

"""Run what is missing of a study, and keep it as it comes."""

import os
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import polars as pl

from tvist_lab.runners import Failed, in_order
from tvist_lab.study.columns import Schema, frame
from tvist_lab.study.store import Store
from tvist_lab.study.work import FAILED, Job, Row, failed, measure, measure_each, why

PART = 32
"""Number of jobs in a part: at most as many are lost when the program is killed."""
FEW = 16
"""Largest number of motions that do not justify another process."""


def made(jobs: Sequence[Job], work: Callable[[Job], tuple[Row, ...]] = measure) -> Iterator[tuple[Row, ...]]:
    """Make all jobs on all cores of this machine; yield the rows of each in order, as soon as they are available.

    Args:
        jobs: The jobs.
        work: `measure`, which fails with the first method that does, or `measure_each`.
    """
    motions = max((job.motions for job in jobs), default=1)
    return in_order(work, jobs, few=max(FEW // motions, 2))


@dataclass(frozen=True)
class Plan:
    """All that a study makes, and what its rows are."""

    jobs: Sequence[Job]
    """The jobs, each with as many rows as every other."""
    schema: Schema
    """Types of the columns."""
    identity: dict[str, Any]
    """What determines the rows, by names that a message can give."""

    @property
    def rows_of_job(self) -> int:
        """Number of rows of each job."""
        return self.jobs[0].motions


@dataclass(frozen=True)
class Done:
    """The rows of a job, and the time that it took."""

    rows: tuple[Row, ...]
    worker: str
    """Host and process that did it."""
    began: float
    """Start on that host's monotonic clock [s]."""
    ended: float
    """End on the same clock [s]."""


def do(job: Job) -> Done:
    """Do a job in a worker."""
    began = time.monotonic()
    return Done(measure_each(job), f"{platform.node()}:{os.getpid()}", began, time.monotonic())


@dataclass
class Effort:
    """What a run took, by worker."""

    tasks: int = 0
    """Number of jobs done."""
    task_s: float = 0.0
    """Their time, summed [s]."""
    _spans: dict[str, tuple[float, float]] = field(default_factory=dict)

    def add(self, one: Done) -> None:
        """Add a job."""
        self.tasks += 1
        self.task_s += one.ended - one.began
        began, ended = self._spans.get(one.worker, (one.began, one.ended))
        self._spans[one.worker] = min(began, one.began), max(ended, one.ended)

    @property
    def workers(self) -> int:
        """Number of processes that did jobs."""
        return len(self._spans)

    @property
    def overhead_percent(self) -> float | None:
        """Time between the jobs of each worker, for scheduling and transfer, relative to the jobs' [%]."""
        if not self.task_s:
            return None
        return 100.0 * (sum(ended - began for began, ended in self._spans.values()) / self.task_s - 1.0)


@dataclass(frozen=True)
class Ran:
    """A study that was run."""

    rows: pl.DataFrame
    """All rows."""
    resumed: int
    """Number of jobs that were done before."""
    effort: Effort
    """What the others took."""


Runner = Callable[[Callable[[Job], Done], Sequence[Job]], Iterator[tuple[int, Done | Failed]]]
"""`tvist_lab.runners.outcomes` with an executor."""


def run(plan: Plan, folder: Path, runner: Runner, begin: Callable[[int], Callable[[int], None]]) -> Ran:
    """Run the jobs that are missing or failed, and write all rows.

    Args:
        plan: The study.
        folder: Folder to keep the rows in.
        runner: What runs the jobs.
        begin: Called with the number of jobs to run; returns what is called with the number of those just done.

    Raises:
        StoreError: The folder holds something else, is in use, or cannot be written.
        OSError: The runner cannot run.
    """
    with Store(folder, plan.identity, plan.schema) as store:
        done = store.done(plan.rows_of_job)
        missing = _Missing(plan.jobs, [place for place in range(len(plan.jobs)) if place not in done])
        effort = Effort()
        _run(missing, plan, store, runner, effort, begin(len(missing)))
        return Ran(store.finish(), len(done), effort)


def _run(
    missing: "_Missing",
    plan: Plan,
    store: Store,
    runner: Runner,
    effort: Effort,
    advance: Callable[[int], None],
) -> None:
    kept: list[Row] = []
    pending = 0
    try:
        for index, outcome in runner(do, missing) if missing else ():
            if isinstance(outcome, Failed):
                rows = failed(missing[index], FAILED, why(outcome.error))
            else:
                rows = outcome.rows
                effort.add(outcome)
            first = missing.places[index] * plan.rows_of_job
            kept += [{"row": first + place, **row} for place, row in enumerate(rows)]
            pending += 1
            if pending == PART:
                part, kept, pending = kept, [], 0  # what cannot be written is not tried again below
                store.keep(frame(part, plan.schema))
            advance(1)
    finally:
        if kept:
            store.keep(frame(kept, plan.schema))


class _Missing(Sequence[Job]):
    """Jobs of a study by their places among those to run."""

    def __init__(self, jobs: Sequence[Job], places: Sequence[int]) -> None:
        self._jobs, self.places = jobs, places

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, place: Any) -> Any:
        return self._jobs[self.places[place]]


def digest(content: object) -> str:
    """Return the beginning of a hash of what can be encoded."""
    return sha256(msgspec.json.encode(content, order="sorted")).hexdigest()[:16]

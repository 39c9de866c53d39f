"""Run the missing jobs of a study, and store rows while jobs finish."""

import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from tvist_lab.runners import Failed, InlineExecutor, outcomes, processes
from tvist_lab.study.store import Store
from tvist_lab.study.study import Study
from tvist_lab.study.work import FAILED, Row, failed, measure_each, why

PART = 32  # number of jobs in a part, and the most that are lost if the program is killed
FEW_MOTIONS = 16  # largest number of motions that are made in this process

Progress = Callable[[int], AbstractContextManager[Callable[[int], None]]]
"""Function of the number of jobs to run; its block yields a function that counts finished jobs."""


@dataclass
class StudyRun:
    """A study that was run."""

    rows: pl.DataFrame
    resumed: int  # number of jobs that were done before
    tasks: int  # number of jobs that were run now


def run(
    study: Study,
    folder: Path | None = None,
    executor: Callable[[], AbstractContextManager[Executor]] | None = None,
    progress: Progress = lambda _: nullcontext(lambda _: None),
) -> StudyRun:
    """Run missing and failed jobs, and write all rows to `folder`, if given.

    `executor` starts an executor for the jobs, by default processes of this machine given enough jobs. Raises
    StoreError if the folder is in use, unwritable, or of another study; OSError if the executor cannot run.
    """
    with ExitStack() as stack:
        if folder is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tvist-own-")))
        store = stack.enter_context(Store(folder, study.determined_by(), study.schema))
        done = store.done()
        missing = [place for place in range(len(study.cases)) if place not in done]
        if missing:
            few = len(missing) * next(study.jobs(missing)).motions <= FEW_MOTIONS
            pool = stack.enter_context((executor or (InlineExecutor if few else processes))())
            _run(missing, study, store, pool, stack.enter_context(progress(len(missing))))
        return StudyRun(store.finish(), len(done), len(missing))


def _run(
    missing: Sequence[int], study: Study, store: Store, executor: Executor, advance: Callable[[int], None]
) -> None:
    kept: list[Row] = []
    pending = 0
    try:
        for index, outcome in outcomes(executor, measure_each, study.jobs(missing)):
            place = missing[index]
            if isinstance(outcome, Failed):
                outcome = failed(next(study.jobs([place])), FAILED, why(outcome.error))  # noqa: PLW2901  its failure
            kept += [{"case": place, **row} for row in outcome]
            pending += 1
            if pending == PART:
                part, kept, pending = kept, [], 0  # do not try below to write the same rows again
                store.keep(study.frame(part))
            advance(1)
    finally:
        if kept:
            store.keep(study.frame(kept))

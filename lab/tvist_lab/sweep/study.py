"""Run what is missing of a sweep, and keep it as it comes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec
import polars as pl

from tvist_lab.runners import Failed, Runner
from tvist_lab.sweep.columns import FAILED, Row
from tvist_lab.sweep.store import Store
from tvist_lab.sweep.tasks import SweepTask, SweepTasks
from tvist_lab.sweep.work import TaskRows, failed, measure, why

PART = 32
"""Number of tasks in a part: at most as many are lost when the program is killed."""


@dataclass
class Effort:
    """What a run took, by worker."""

    tasks: int = 0
    """Number of tasks done."""
    task_s: float = 0.0
    """Their time, summed [s]."""
    _spans: dict[str, tuple[float, float]] = field(default_factory=dict)

    def add(self, one: TaskRows) -> None:
        """Add a task."""
        self.tasks += 1
        self.task_s += one.ended - one.began
        began, ended = self._spans.get(one.worker, (one.began, one.ended))
        self._spans[one.worker] = min(began, one.began), max(ended, one.ended)

    @property
    def workers(self) -> int:
        """Number of processes that did tasks."""
        return len(self._spans)

    @property
    def overhead_percent(self) -> float | None:
        """Time between the tasks of each worker, for scheduling and transfer, relative to the tasks' [%]."""
        if not self.task_s:
            return None
        return 100.0 * (sum(ended - began for began, ended in self._spans.values()) / self.task_s - 1.0)


@dataclass(frozen=True)
class Study:
    """A sweep that was run."""

    rows: pl.DataFrame
    """All rows; see `tvist_lab.sweep.columns`."""
    resumed: int
    """Number of tasks that were done before."""
    effort: Effort
    """What the others took."""


def identity(tasks: SweepTasks) -> dict[str, Any]:
    """Return what determines the rows, by names that a message can give."""
    spec = msgspec.to_builtins(tasks.spec)
    robots = [
        {
            "model": robot.description.robot.model,
            "sha256": _digest(robot.description),
            "calibration": robot.recipes[0].calibration and _digest(robot.recipes[0].calibration),
        }
        for robot in tasks.robots
    ]
    files = [own.sha256 for recipe in tasks.robots[0].recipes for own in recipe.own]
    return {
        **spec,
        "contents of robots or calibrations": robots,
        "contents of shapers": files,
        "version of tvist": version("tvist"),
    }


def run(
    tasks: SweepTasks, folder: Path, runner: Runner, begin: Callable[[int], Callable[[int], None]]
) -> Study:
    """Run the tasks that are missing or failed, and write all rows.

    Args:
        tasks: The tasks.
        folder: Folder to keep them in.
        runner: What runs them.
        begin: Called with the number of tasks to run; returns what is called with the number of those just done.

    Raises:
        StoreError: The folder holds something else, is in use, or cannot be written.
        OSError: The runner cannot run.
    """
    with Store(folder, identity(tasks)) as store:
        done = store.done(len(tasks.spec.shapers))
        missing = _Missing(tasks, [position for position in range(len(tasks)) if position not in done])
        effort = Effort()
        _run(missing, store, runner, effort, begin(len(missing)))
        return Study(store.finish(), len(done), effort)


def _run(
    missing: "_Missing", store: Store, runner: Runner, effort: Effort, advance: Callable[[int], None]
) -> None:
    kept: list[Row] = []
    pending = 0
    try:
        for index, outcome in runner.run(measure, missing) if missing else ():
            if isinstance(outcome, Failed):
                kept += failed(missing[index], FAILED, why(outcome.error))
            else:
                kept += outcome.rows
                effort.add(outcome)
            pending += 1
            if pending == PART:
                rows, kept, pending = kept, [], 0  # what cannot be written is not tried again below
                store.keep(rows)
            advance(1)
    finally:
        if kept:
            store.keep(kept)


class _Missing(Sequence[SweepTask]):
    """Tasks of a sweep by their places among those to run."""

    def __init__(self, tasks: SweepTasks, positions: Sequence[int]) -> None:
        self._tasks, self._positions = tasks, positions

    def __len__(self) -> int:
        return len(self._positions)

    def __getitem__(self, place: Any) -> Any:
        return self._tasks[self._positions[place]]


def _digest(content: object) -> str:
    return sha256(msgspec.json.encode(content, order="sorted")).hexdigest()[:16]

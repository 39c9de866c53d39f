"""Run a study whose rows are kept in a folder: its options, its progress, and what it took."""

import re
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import FigureOptions
from tvist_cli.output import progress, say

if TYPE_CHECKING:
    from tvist_lab.study.engine import Plan, Ran

ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?([^\s:/\[\]]+|\[[\da-fA-F:.]+\]):\d{1,5}")
"""Address of a scheduler."""


def folder_of(
    file: Path, output: Path | None, processes: int | None, scheduler: str | None, look: FigureOptions
) -> Path:
    """Return the folder of a study's rows, after a check of the options.

    Raises:
        Failure: An option is invalid, or there is no name for the folder.
    """
    if processes is not None and scheduler is not None:
        raise Failure("give either --processes or --scheduler", code=2)
    if processes is not None and not 1 <= processes <= 1024:
        raise Failure(f"processes is {processes}: must be 1 to 1024", code=2)
    if scheduler is not None and not ADDRESS.fullmatch(scheduler):
        raise Failure(f"scheduler is {scheduler!r}: must be an address such as tcp://HOST:8786", code=2)
    if output is None and not file.suffix:
        raise Failure(f"{file} has no suffix to leave out: give a folder as --output", code=2)
    folder = file.with_suffix("") if output is None else output
    look.check(folder)
    return folder


def run(plan: "Plan", folder: Path, processes: int | None, scheduler: str | None) -> "tuple[Ran, float]":
    """Run what is missing of a study; return its rows, and the time that it took [s].

    Raises:
        Failure: The folder cannot be used, or the runner does not run.
    """
    from tvist_lab.runners.cluster import Cluster
    from tvist_lab.study import engine

    began = time.monotonic()
    with told(OSError), ExitStack() as stack:
        kept = f"they are kept in {folder}, and the same command continues"

        def begin(missing: int) -> Any:
            bar = stack.enter_context(progress(missing, "moves", kept))
            return lambda done: bar(done, None)

        ran = engine.run(plan, folder, Cluster(scheduler, processes), begin)
    return ran, time.monotonic() - began


def about(ran: "Ran", elapsed: float, folder: Path) -> dict[str, Any]:
    """Return what every study prints with --json about its rows and its run."""
    from tvist_lab.study.store import ROWS
    from tvist_lab.study.work import FAILED, TOO_WEAK

    rows, effort = ran.rows, ran.effort
    return {
        "rows_file": str(folder / ROWS),
        "rows": len(rows),
        "failed": int((rows["status"] == FAILED).sum()),
        "too_weak": int((rows["status"] == TOO_WEAK).sum()),
        "tasks_done_before": ran.resumed,
        "run": {
            "tasks": effort.tasks,
            "workers": effort.workers,
            "elapsed_s": elapsed,
            "task_s": effort.task_s,
            "scheduling_and_transfer_percent": effort.overhead_percent,
        },
    }


def say_effort(result: dict[str, Any]) -> None:
    """Say what a run took, if it did anything."""
    from tvist_lab.words import counted

    run = result["run"]
    if run["tasks"]:
        say(
            f"{counted(run['tasks'], 'move')} took {run['elapsed_s']:.0f} s, {run['workers']} at once; scheduling and "
            f"transfer took {run['scheduling_and_transfer_percent']:.1f} % of the tasks' own time"
        )


def tell_failed(result: dict[str, Any], folder: Path) -> None:
    """Say how many rows were not measured.

    Raises:
        Failure: Some failed.
    """
    if result["too_weak"]:
        say(
            f"{result['too_weak']} of {result['rows']} rows were left out: the drives are too weak for their moves"
        )
    if result["failed"]:
        raise Failure(
            f"{result['failed']} of {result['rows']} rows failed; their column error in {folder} says why, and the "
            "same command tries them again"
        )

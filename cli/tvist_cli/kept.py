"""Run a study whose rows are kept in a folder: its options, its progress, and what it took."""

import logging
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import FigureOptions
from tvist_cli.output import print_json, progress, say
from tvist_cli.studying import check_range, show

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import polars as pl

    from tvist_lab.study.engine import Plan
    from tvist_lab.study.tables import Entry, Shown

ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?([^\s:/\[\]]+|\[[\da-fA-F:.]+\]):\d{1,5}")
"""Address of a scheduler."""
PATIENCE = 10.0
"""Time within which a scheduler has to answer, and to have a worker [s]."""


def folder_of(
    file: Path, output: Path | None, processes: int | None, scheduler: str | None, look: FigureOptions
) -> Path:
    """Return the folder of a study's rows, after a check of the options.

    Raises:
        Failure: An option is invalid, or there is no name for the folder.
    """
    if processes is not None and scheduler is not None:
        raise Failure("give either --processes or --scheduler", code=2)
    if processes is not None:
        check_range("processes", processes, 1, 1024)
    if scheduler is not None and not ADDRESS.fullmatch(scheduler):
        raise Failure(f"scheduler is {scheduler!r}: must be an address such as tcp://HOST:8786", code=2)
    if output is None and not file.suffix:
        raise Failure(f"{file} has no suffix to leave out: give a folder as --output", code=2)
    folder = file.with_suffix("") if output is None else output
    look.check(folder)
    return folder


def run(
    plan: "Plan", folder: Path, processes: int | None, scheduler: str | None
) -> "tuple[pl.DataFrame, dict[str, Any]]":
    """Run what is missing of a study.

    Returns:
        All rows; and what every study prints with --json about its rows and its run.

    Raises:
        Failure: The folder cannot be used, or the runner does not run.
    """
    from tvist_lab.runners import outcomes
    from tvist_lab.study import engine
    from tvist_lab.study.store import ROWS
    from tvist_lab.study.work import FAILED, TOO_WEAK

    began = time.monotonic()
    with told(OSError), ExitStack() as stack:
        kept = f"they are kept in {folder}, and the same command continues"

        def begin(missing: int) -> Any:
            bar = stack.enter_context(progress(missing, "moves", kept))
            return lambda done: bar(done, None)

        def runner(work: Any, jobs: Any) -> Any:
            return outcomes(stack.enter_context(executor(processes, scheduler)), work, jobs)

        try:
            ran = engine.run(plan, folder, runner, begin)
        except ChildProcessError as error:
            raise ChildProcessError(f"{error}; some moves are done: {kept}") from error
    rows, effort = ran.rows, ran.effort
    return rows, {
        "rows_file": str(folder / ROWS),
        "rows": len(rows),
        "failed": int((rows["status"] == FAILED).sum()),
        "too_weak": int((rows["status"] == TOO_WEAK).sum()),
        "tasks_done_before": ran.resumed,
        "run": {
            "tasks": effort.tasks,
            "workers": effort.workers,
            "elapsed_s": time.monotonic() - began,
            "task_s": effort.task_s,
            "scheduling_and_transfer_percent": effort.overhead_percent,
        },
    }


@contextmanager
def executor(number: int | None, scheduler: str | None) -> "Iterator[Executor]":
    """Start processes of this machine, or connect to a scheduler of Dask.

    Raises:
        ConnectionError: There is no scheduler at the address, or it has no workers or other ones.
    """
    if scheduler is None:
        from tvist_lab.runners import processes

        with processes(number) as pool:
            yield pool
        return
    from distributed import Client

    # What is done again when a worker dies is no reason for a warning.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no Dask scheduler answers at {scheduler}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise ConnectionError(
                f"the Dask scheduler at {scheduler} has no workers: start some with dask worker {scheduler}"
            ) from error
        own = version("tvist")
        for worker, found in client.run(version, "tvist", on_error="return").items():
            if found != own:
                has = f"tvist {found}" if isinstance(found, str) else "no tvist"
                raise ConnectionError(f"the worker {worker} has {has}: install tvist {own}")
        yield client.get_executor(pure=False)


def tell(
    result: dict[str, Any],
    entries: "Iterable[Entry]",
    columns: "Sequence[Shown]",
    *,
    json: bool,
    title: str = "",
    terms: str = "",
    whys: Iterable[str] = (),
) -> None:
    """Print a study that was run: one JSON object, or its table and what it took; and what was not measured.

    Args:
        result: What --json prints.
        entries: Entries of the table.
        columns: Its columns.
        json: Print one JSON object.
        title: What stands before the number of rows.
        terms: What its columns mean.
        whys: What failed, and why.

    Raises:
        Failure: Some rows failed.
    """
    from tvist_lab.words import counted

    rows, run = result["rows"], result["run"]
    if json:
        print_json(result)
    else:
        done = f"{rows} rows in {result['rows_file']}; {result['tasks_done_before']} moves were done before"
        show(title + done, entries, columns)
        if terms:
            say(terms)
        if run["tasks"]:
            say(
                f"{counted(run['tasks'], 'move')} took {run['elapsed_s']:.0f} s, {run['workers']} at once; scheduling "
                f"and transfer took {run['scheduling_and_transfer_percent']:.1f} % of the tasks' own time"
            )
        if result["figure"] is not None:
            say(f"{result['figure']} shows the table")
    for why in whys:
        say(why)
    if result["too_weak"]:
        say(f"{result['too_weak']} of {rows} rows were left out: the drives are too weak for their moves")
    if result["failed"]:
        raise Failure(
            f"{result['failed']} of {rows} rows failed; their column error in {Path(result['rows_file']).parent} says "
            "why, and the same command tries them again"
        )

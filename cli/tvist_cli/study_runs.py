"""Run a study, and print and write its results."""

import logging
import re
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from tvist_cli.failure import Failure, Misuse, check_range, failing_on
from tvist_cli.figure_files import FigureOptions
from tvist_cli.output import out, print_json, progress, say, table, typed, words, write_json, write_report
from tvist_cli.study_asked import preset_study, swept
from tvist_cli.study_options import StudyOptions
from tvist_lab.figures import house_style
from tvist_lab.phrases import counted
from tvist_lab.report import study_figures, study_page
from tvist_lab.runners import processes as some_processes
from tvist_lab.study import engine
from tvist_lab.study.columns import cells, meanings, titles
from tvist_lab.study.study import Result, Study, StudyError, read_study
from tvist_lab.study.work import FAILED, TOO_WEAK

ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?([^\s:/\[\]]+|\[[\da-fA-F:.]+\]):\d{1,5}")
"""Address of a Dask scheduler."""
PATIENCE = 10.0  # time within which a scheduler must answer and have a worker [s]
LISTED = 12  # largest number of motions that are listed


def run(
    name: str,
    file: Path | None,
    options: StudyOptions,
    *,
    folder: Path | None,
    figures: Path | None,
    look: FigureOptions,
    report: Path | None,
    processes: int | None,
    scheduler: str | None,
    json: bool,
) -> None:
    """Run a study (name or file); Failure if an option is invalid, the study cannot run, or rows failed."""
    executor = _executor(processes, scheduler)
    look.check(figures, report, options.save_moves)
    if file is None:
        study = preset_study(name, options)
    else:
        with failing_on(StudyError):
            study = read_study(file) if file.suffix == ".py" else swept(file)
    result = _ran(study, folder, executor)
    if folder is not None:
        write_json(folder / "result.json", result.values)
    if report is not None:
        with house_style():
            write_report(report, study_page(result, study_figures(result), typed()))
    look.write(figures, lambda: {name: figure for name, (figure, _) in study_figures(result).items()})
    _tell(result, json=json)


def _executor(
    number: int | None, scheduler: str | None
) -> Callable[[], AbstractContextManager[Executor]] | None:
    """Return a function that starts the requested executor; None if none was requested."""
    if number is not None and scheduler is not None:
        raise Misuse("give either --processes or --scheduler")
    if number is not None:
        check_range("processes", number, 1, 1024)
        return lambda: some_processes(number)
    if scheduler is None:
        return None
    if not ADDRESS.fullmatch(scheduler):
        raise Misuse(f"scheduler is {scheduler!r}: must be an address such as tcp://HOST:8786")
    return lambda: _cluster(scheduler)


@contextmanager
def _cluster(scheduler: str) -> Iterator[Executor]:
    from distributed import Client

    # Dask warns about tasks that it repeats after the death of a worker; users need not know.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no Dask scheduler answers at {scheduler}: check that it runs") from error
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


def _ran(
    study: Study, folder: Path | None, executor: Callable[[], AbstractContextManager[Executor]] | None
) -> Result:
    began = time.monotonic()
    kept = (
        "nothing was kept" if folder is None else f"they are kept in {folder}, and the same command continues"
    )
    try:
        ran = engine.run(study, folder, executor, lambda missing: progress(missing, "moves", kept))
    except ChildProcessError as error:
        raise ChildProcessError(f"{error}; some moves are done: {kept}") from error
    about = {
        "date": datetime.now(UTC).date().isoformat(),  # noqa: TID251  a date is meant
        "rows": len(ran.rows),
        "failed": int((ran.rows["status"] == FAILED).sum()),
        "too_weak": int((ran.rows["status"] == TOO_WEAK).sum()),
        "tasks_done_before": ran.resumed,
        "tasks": ran.tasks,
        "elapsed_s": time.monotonic() - began,
    }
    return study.result(ran.rows, about)


def _tell(result: Result, *, json: bool) -> None:
    """Print a finished study as one JSON object, or as tables with a list of what was not measured."""
    values, rows = result.values, result.rows
    if json:
        print_json(values)
    else:
        _print(result)
    if values["too_weak"]:
        say(
            f"{values['too_weak']} of {values['rows']} rows were left out: the drives are too weak for their moves"
        )
    for row in rows.filter(rows["status"] == FAILED).head(1).iter_rows(named=True):
        axes = result.study.cases[0].axes
        case = ", ".join(f"{name} {row[name]}" for name in axes if not isinstance(row[name], list))
        raise Failure(
            f"{values['failed']} of {values['rows']} rows failed, the first with {row['shaper']} at {case}: "
            f"{row['error']}; with --output, rows.parquet has the reasons, and the same command tries again"
        )
    if "failure" in values:
        raise Failure(values["failure"])


def _print(result: Result) -> None:
    values = result.values
    tables = [one for one in result.study.tables_of(result) if not one.listing or len(one.entries) <= LISTED]
    for one in tables:
        table(one.title or values["title"], titles(one.columns), cells(one.entries, one.columns))
    words({word: said for one in tables for word, said in meanings(one.columns).items()})
    for line in values.get("verdict", ()):
        out.print(line)
    if held := values.get("held_out"):
        out.print(held)
    if values["tasks"]:
        before = f"; {values['tasks_done_before']} were done before" if values["tasks_done_before"] else ""
        say(f"{counted(values['tasks'], 'case')} took {values['elapsed_s']:.0f} s{before}")
    for note in values["notes"]:
        say(note)

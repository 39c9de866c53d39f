"""`tvist sweep`: compare shapers over payloads, errors, moves and robots, on all cores or a cluster."""

import re
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import number, print_json, progress, say, table

if TYPE_CHECKING:
    from tvist_lab.figures import FigureFiles
    from tvist_lab.study.engine import Ran

ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?([^\s:/\[\]]+|\[[\da-fA-F:.]+\]):\d{1,5}")
"""Address of a scheduler."""
SHOWN = 5
"""Largest number of failed rows that are told one by one."""
DRAWN = 100
"""Largest number of settings in a figure."""


def sweep(
    spec: Path,
    *,
    output: Path | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Make random moves of robots with every shaper, payload and error that a file lists, and keep a row for each.

    Rows are kept in a folder as they come, so that the same command continues where it was interrupted; it repeats
    what had failed. At the end sweep.parquet in that folder holds all rows, and sweep.png summarizes them. Rows do not
    depend on the number of processes, the order, or interruptions.

    Args:
        spec: TOML file with shapers, moves and payloads, and optionally errors, robots, seed, modes, limits, stroke,
            wrists, streams and disturbances.
        output: Folder for the rows [that of the file, with its name but without .toml].
        processes: Number of processes on this machine [one for each core].
        scheduler: Address of a Dask scheduler whose workers to use instead, such as tcp://HOST:8786.
        look: How to write the figure.
        json: Print one JSON object.
    """
    from tvist_cli.swept import axes_of
    from tvist_lab.runners.cluster import Cluster
    from tvist_lab.study.engine import run

    if processes is not None and scheduler is not None:
        raise Failure("give either --processes or --scheduler", code=2)
    if processes is not None and not 1 <= processes <= 1024:
        raise Failure(f"processes is {processes}: must be 1 to 1024", code=2)
    if scheduler is not None and not ADDRESS.fullmatch(scheduler):
        raise Failure(f"scheduler is {scheduler!r}: must be an address such as tcp://HOST:8786", code=2)
    if output is None and not spec.suffix:
        raise Failure(f"{spec} has no suffix to leave out: give a folder as --output", code=2)
    folder = spec.with_suffix("") if output is None else output
    look.check(folder)
    axes = axes_of(spec)
    began = time.monotonic()
    with told(OSError), ExitStack() as stack:
        kept = f"they are kept in {folder}, and the same command continues"

        def begin(missing: int) -> Any:
            bar = stack.enter_context(progress(missing, "moves", kept))
            return lambda done: bar(done, None)

        study = run(axes.plan(), folder, Cluster(scheduler, processes), begin)
    elapsed = time.monotonic() - began
    result = _result(spec, folder, study, elapsed)
    _draw(result, look.into(folder))
    if json:
        print_json(result)
    else:
        _print(result)
    _tell(study, folder)


def _result(spec: Path, folder: Path, study: "Ran", elapsed: float) -> dict[str, Any]:
    from tvist_lab.study.store import ROWS
    from tvist_lab.study.summary import summary
    from tvist_lab.study.work import FAILED, TOO_WEAK

    rows, effort = study.rows, study.effort
    return {
        "spec": str(spec),
        "rows_file": str(folder / ROWS),
        "rows": len(rows),
        "failed": int((rows["status"] == FAILED).sum()),
        "too_weak": int((rows["status"] == TOO_WEAK).sum()),
        "tasks_done_before": study.resumed,
        "run": {
            "tasks": effort.tasks,
            "workers": effort.workers,
            "elapsed_s": elapsed,
            "task_s": effort.task_s,
            "scheduling_and_transfer_percent": effort.overhead_percent,
        },
        "summary": summary(rows),
    }


def _draw(result: dict[str, Any], files: "FigureFiles") -> None:
    from tvist_lab.figures import sweep_figure
    from tvist_lab.study.summary import setting_name

    entries = result["summary"]
    settings = [setting_name(entry) for entry in entries]
    result["figure"] = None
    if len(set(settings)) <= DRAWN:
        try:
            result["figure"] = str(files.write(sweep_figure(entries, settings), "sweep"))
        except OSError as error:
            raise Failure(
                f"the figure in {files.folder} cannot be written: {error.strerror}; "
                f"all rows are in {result['rows_file']}"
            ) from error


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.study.summary import setting_name

    run = result["run"]
    table(
        f"{result['rows']} rows in {result['rows_file']}; {result['tasks_done_before']} moves were done before",
        (
            "setting",
            "shaper",
            "moves",
            "delay ms",
            "less %",
            "p5",
            "than waiting",
            "still ms",
            "p90",
            "q̈/limit",
        ),
        [_cells(entry, setting_name(entry)) for entry in result["summary"]],
    )
    say(
        "less: reduction of the peak compared with the unshaped move, median and 5th percentile; still: last time |α| "
        "exceeds 0.1 m/s², from the stop of the unshaped reference"
    )
    if run["tasks"]:
        say(
            f"{run['tasks']} moves took {run['elapsed_s']:.0f} s on {run['workers']} processes; scheduling and "
            f"transfer took {run['scheduling_and_transfer_percent']:.1f} % of the tasks' own time"
        )
    if result["figure"] is not None:
        say(f"{result['figure']} shows the table")


def _cells(entry: dict[str, Any], setting: str) -> tuple[str, ...]:
    less, still = entry["reduction_percent"], entry["still_after_unshaped_stop_ms"]
    return (
        setting, entry["shaper"], str(entry["measured"]), number(entry["delay_ms"]["median"], 0),
        number(less["median"], 1), number(less["p5"], 1), number(entry["less_than_waiting_percent"]["median"], 1),
        number(still["median"], 0), number(still["p90"], 0), number(entry["peak_acceleration_ratio"]["max"]),
    )  # fmt: skip


def _tell(study: "Ran", folder: Path) -> None:
    """Name the moves that failed.

    Raises:
        Failure: There are some.
    """
    from tvist_lab.study.summary import setting_name
    from tvist_lab.study.work import FAILED, TOO_WEAK

    rows = study.rows
    weak = int((rows["status"] == TOO_WEAK).sum())
    if weak:
        say(f"{weak} of {len(rows)} rows were left out: the drives are too weak for their moves")
    failed = rows.filter(rows["status"] == FAILED)
    for row in failed.head(SHOWN).iter_rows(named=True):
        say(f"move {row['move']} ({setting_name(row)}) with {row['shaper']} failed: {row['error']}")
    if len(failed):
        raise Failure(
            f"{len(failed)} of {len(rows)} rows failed; their column error in {folder} says why, and the same command "
            "tries them again"
        )

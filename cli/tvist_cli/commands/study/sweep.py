"""`tvist study sweep`: compare shapers over payloads, errors, moves and robots, on all cores or a cluster."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli import studying
from tvist_cli.failure import Failure
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import print_json, say, table

if TYPE_CHECKING:
    from tvist_lab.figures import FigureFiles
    from tvist_lab.study.engine import Ran

NAMED = 5
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
    from tvist_cli.commands.study.swept import axes_of
    from tvist_lab.study.summary import summary

    folder = studying.folder_of(spec, output, processes, scheduler, look)
    ran, elapsed = studying.run(axes_of(spec).plan(), folder, processes, scheduler)
    result = {"spec": str(spec), **studying.about(ran, elapsed, folder), "summary": summary(ran.rows)}
    _draw(result, look.into(folder))
    if json:
        print_json(result)
    else:
        _print(result)
    _name_failed(ran)
    studying.tell_failed(result, folder)


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
    from tvist_lab.study.summary import SHOWN, setting_name
    from tvist_lab.study.tables import cells, titles

    entries = [{"setting": setting_name(entry), **entry} for entry in result["summary"]]
    table(
        f"{result['rows']} rows in {result['rows_file']}; {result['tasks_done_before']} moves were done before",
        titles(SHOWN),
        cells(entries, SHOWN),
    )
    say(
        "less: reduction of the peak compared with the unshaped move, median and 5th percentile; still: last time |α| "
        "exceeds 0.1 m/s², from the stop of the unshaped reference"
    )
    studying.say_effort(result)
    if result["figure"] is not None:
        say(f"{result['figure']} shows the table")


def _name_failed(ran: "Ran") -> None:
    """Name some moves that failed."""
    from tvist_lab.study.summary import setting_name
    from tvist_lab.study.work import FAILED

    for row in ran.rows.filter(ran.rows["status"] == FAILED).head(NAMED).iter_rows(named=True):
        say(f"move {row['move']} ({setting_name(row)}) with {row['shaper']} failed: {row['error']}")

"""`tvist study`: run a study that comes with the package, or one of your own from a file."""

from pathlib import Path
from typing import Annotated

from tvist_cli.failure import Failure
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.offered import NAMES, STUDIES
from tvist_cli.study_options import AS_SHIPPED, StudyOptions


def study(
    study: Annotated[str, STUDIES],
    /,
    *,
    options: StudyOptions = AS_SHIPPED,
    output: Path | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Make simulated moves by shapers, as fast as possible, and compare the vibration after each.

    moves compares shapers and simpler methods on any moves, each unshaped and shaped: waiting, a slower
    motion of the same duration, ZV frozen at the target, and fixed MZV, EI2 and EI3 designed for the whole
    workspace.

    match compares two shapers plant by plant, and says where one is better. The difference of their
    reductions has a 95 % interval: that of the median is exact (sign test), that of the 5th percentile a
    bootstrap over pairs. One is better on a plant if the interval of the median is on one side of zero. Of
    twenty plants without a difference, one is called different.

    robustness compares shapers on arms whose springs are all up to 30 % stiffer or softer than calibrated,
    with a declared mass up to 20 % above or below the carried one, and on plants. Fewer than 20 moves have
    no 5th percentile.

    bench ranks shapers by how soon fifteen different arms come to rest, and by the vibration until then.
    The controller assumes 100, 110 and 90 % of each payload. All arms but two differ from its model. A
    shaper that uses future samples or does not report its full delay is listed but not ranked.

    A TOML file is a sweep: random moves of robots with every shaper, payload and error that it lists. A
    Python file contains STUDY = Study(...).

    Rows are kept in a folder as they come, so that the same command continues where it was interrupted; it
    repeats what had failed. Rows do not depend on the number of processes, the order, or interruptions.

    Args:
        study: moves, match, robustness, bench, or a TOML or Python file.
        options: What it is made of.
        output: Folder to keep the rows in: rows.parquet in it has all at the end, result.json the result,
            and figures are there [of a file: its name without suffix; else nothing is kept].
        processes: Number of processes on this machine [one for each core].
        scheduler: Address of a Dask scheduler whose workers to use instead, such as tcp://HOST:8786.
        figures: Folder to write figures to [that of the rows, if they are kept].
        look: How to write the figures.
        report: File to write a web page with the verdict, the tables and the figures to.
        json: Print one JSON object.
    """
    file = None if study in NAMES else Path(study)
    if file is not None and file.suffix not in {".toml", ".py"}:
        raise Failure(
            f"there is no study {study}: give a TOML or Python file, or one of {', '.join(NAMES)}", code=2
        )
    if file is not None and options.given:
        name = next(iter(options.given)).replace("_", "-")
        raise Failure(f"--{name} is for {', '.join(NAMES)}: {file} says itself what it is made of", code=2)
    if file is not None and output is None:
        output = file.with_suffix("")
    from tvist_cli.study_runs import Places, run

    run(
        study, file, options, Places(output, figures or output, look, report), processes, scheduler, json=json
    )

"""`tvist study`: run a study that comes with the package, or your own from a file."""

from pathlib import Path
from typing import Annotated

from tvist_cli.failure import Misuse
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions
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
    look: FigureOptions = DEFAULT_FIGURES,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Simulate moves with several shapers as fast as possible, and compare the vibration after each.

    moves compares shapers and simpler methods on any moves, each unshaped and shaped: waiting, a slower motion of the
    same duration, ZV frozen at the target, and fixed MZV, EI2 and EI3 designed for the whole workspace.

    match compares two shapers plant by plant and reports where one is better. The difference of their
    reductions has a 95 % interval: exact for the median (sign test), a bootstrap over pairs for the 5th
    percentile. One is better on a plant if the interval of the median lies on one side of zero; so of twenty
    plants without a difference, about one is reported as different.

    robustness compares shapers on arms whose springs are all up to 30 % stiffer or softer than calibrated, with a
    declared mass up to 20 % above or below the carried one, and on plants. Fewer than 20 moves have no 5th percentile.

    bench ranks shapers by how soon fifteen different arms come to rest, and by the vibration until then. The
    controller assumes 100, 110 and 90 % of each payload. All arms but two differ from its model. A shaper
    that uses future samples or does not report its full delay is listed but not ranked.

    A TOML file is a sweep: random moves of robots with every shaper, payload and error that it lists. A
    Python file contains STUDY = Study(...).

    Finished rows are kept in a folder at once, so that the same command continues an interrupted study and
    repeats failed rows. The result does not depend on the number of processes, the order, or interruptions.

    Args:
        study: Run moves, match, robustness, bench, or a TOML or Python file.
        options: What it is made of.
        output: Keep the rows in this folder; at the end it has all of them in rows.parquet, the result in
            result.json, and the figures [for a file, its name without suffix; else nothing is kept].
        processes: Use this number of processes on this machine [one for each core].
        scheduler: Use the workers of the Dask scheduler at this address, such as tcp://HOST:8786.
        figures: Write figures to this folder [that of the rows, if they are kept].
        look: How to write the figures.
        report: Write a web page with the verdict, the tables and the figures to this file.
        json: Print one JSON object.
    """
    file = None if study in NAMES else Path(study)
    if file is not None and file.suffix not in {".toml", ".py"}:
        raise Misuse(f"there is no study {study}: give a TOML or Python file, or one of {', '.join(NAMES)}")
    if file is not None and options.given:
        name = next(iter(options.given)).replace("_", "-")
        raise Misuse(f"--{name} is for {', '.join(NAMES)}: {file} defines its own content")
    if file is not None and output is None:
        output = file.with_suffix("")
    from tvist_cli.study_runs import run

    run(
        study, file, options, folder=output, figures=figures or output, look=look, report=report,
        processes=processes, scheduler=scheduler, json=json,
    )  # fmt: skip

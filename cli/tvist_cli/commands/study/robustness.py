"""`tvist study robustness`: how much each shaper reduces vibration if stiffness or payload are wrong."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.commands.shaperbench import methods_of, modal_calibration
from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import number, print_json, progress, table, typed, write_json
from tvist_cli.simulated_arm import check_count, check_seed

if TYPE_CHECKING:
    from tvist_lab.study.work import Row


def robustness(
    *,
    moves: int = 40,
    against: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    seed: int = 0,
    calibration: str | None = None,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    markdown: Path | None = None,
    json: bool = False,
) -> None:
    """Compare the reduction of vibration with the delay of shapers, on arms other than calibrated.

    Every shaper makes the same random moves of a UR5e with payloads of 0 to 5 kg, on arms all of whose springs are up
    to 30 % stiffer or softer than calibrated, and with a declared mass up to 20 % above or below the carried one.

    Args:
        moves: Number of moves for each error.
        against: Names of the shapers and baselines of tvist shaperbench to run; default: all.
        seed: Seed of moves, payloads and gear errors.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; it needs a modal
            model [ur5e_modal].
        output: JSON file to write the result to.
        figures: Folder to write a figure of reduction against delay to.
        look: How to write the figures.
        markdown: File to write a page with the tables to.
        json: Print one JSON object.
    """
    from tvist_lab.studies import robustness as robust
    from tvist_lab.studies.shaperbench import draw
    from tvist_lab.study.engine import made
    from tvist_lab.study.shaping import ShaperFaultError
    from tvist_plant.description import load

    look.check(figures, output, markdown)
    check_count("moves", moves, 10_000)
    check_seed(seed)
    description = load("ur5e")
    known = modal_calibration(calibration)
    names = None if against is None else [name.lower() for name in against]
    methods = methods_of(None, names, known)[1:]  # all but waiting, with which they are compared
    if not methods:
        raise Failure("against names no shaper besides waiting", code=2)
    jobs = robust.jobs(description, methods, draw(description, moves, seed), seed)
    done: list[Row] = []
    with told(ShaperFaultError), progress(len(jobs), "moves") as bar:
        for rows in made(jobs):
            done += rows
            bar(1, None)
    options = [] if names is None else ["--against", *names]
    options += [] if calibration is None else ["--calibration", calibration]
    result: dict[str, Any] = {
        "command": " ".join(
            ["tvist", "study", "robustness", *options, "--moves", str(moves), "--seed", str(seed)]
        ),
        "moves": moves,
        "seed": seed,
        "calibration": known.name,
        "shapers": robust.report(methods, done),
    }
    _write(result, output, markdown, figures, look)
    if json:
        print_json(result)
        return
    for kind in robust.ERRORS:
        told_wrong = robust.errors_of(kind)
        table(
            f"reduction in %, median / p5 over {moves} moves, with wrong {kind}",
            ("shaper", "delay ms", *told_wrong),
            [_row(row, kind, told_wrong) for row in result["shapers"]],
        )


def _row(row: dict[str, Any], kind: str, names: list[str]) -> tuple[str, ...]:
    found = [row[kind][name]["reduction_percent"] for name in names]
    return (
        row["name"], number(row["delay_ms"], 0),
        *(f"{number(one['median'], 1)} / {number(one['p5'], 1)}" for one in found),
    )  # fmt: skip


def _write(
    result: dict[str, Any],
    output: Path | None,
    markdown: Path | None,
    figures: Path | None,
    look: FigureOptions,
) -> None:
    with told(OSError):
        if output is not None:
            write_json(output, result)
        if markdown is not None:
            from tvist_lab.studies.pages import page
            from tvist_lab.studies.robustness import tables

            markdown.write_text(page("robustness", result, typed(), tables=tables()), encoding="utf-8")
        if figures is not None:
            from tvist_lab.figures import robustness_figure

            write(look.into(figures), {"robustness": robustness_figure(result["shapers"])})

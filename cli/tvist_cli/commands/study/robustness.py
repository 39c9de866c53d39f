"""`tvist study robustness`: how much each shaper reduces vibration if stiffness, payload or plant are wrong."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.shapers_of import modal_for, on_the_bench
from tvist_cli.studying import Figures, Places, check_range, check_seed, command, gathered, give, show


def robustness(
    *,
    moves: int | None = None,
    against: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    hidden: Annotated[list[int] | None, Parameter(consume_multiple=True)] = None,
    robot: str = "ur5e",
    seed: int = 0,
    calibration: str | None = None,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Compare the reduction of vibration with the delay of shapers, on arms other than calibrated.

    Every shaper makes the same random moves, with payloads up to the robot's rating, on arms whose springs are all up
    to 30 % stiffer or softer than calibrated, with a declared mass up to 20 % above or below the carried one, and on
    the plants stribeck, hysteresis, torsion, base, backlash and combined. Fewer than 20 moves have no 5th percentile.

    Args:
        moves: Number of moves for each cell of the tables [60].
        against: Names of the shapers and baselines of tvist shaperbench to run [those of the documentation's page].
        hidden: Seeds of hidden robots, each of which is a plant, too: its springs, dampers, loops, rotors, friction and
            payload are drawn from its seed.
        robot: Name of a robot that comes with the package, or path of a robot file.
        seed: Seed of moves, payloads and gear errors.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; it needs a modal
            model [that of the robot].
        output: JSON file to write the result to.
        figures: Folder to write a figure of reduction against delay to.
        look: How to write the figures.
        json: Print one JSON object.
    """
    from tvist_lab.studies.robustness import jobs, report
    from tvist_lab.studies.shaperbench import draw
    from tvist_lab.study.engine import made
    from tvist_lab.study.held_out import MOVES
    from tvist_lab.study.menus import names
    from tvist_lab.study.shaping import ShaperFaultError

    places = Places(output=output, figures=figures, look=look)
    places.check()
    moves = MOVES if moves is None else moves
    check_range("moves", moves, 1, 10_000)
    check_seed(seed)
    description, known = modal_for(calibration, robot)
    for one in hidden or ():
        check_seed(one)
    against = None if against is None else [name.lower() for name in against]
    chosen = list(names("robustness")) if against is None else against
    _, *methods = on_the_bench(description, known, chosen)  # all but waiting, with which they are compared
    if not methods:
        raise Failure("against names no shaper besides waiting", code=2)
    todo = jobs(description, methods, draw(description, moves, seed), seed, hidden or ())
    done = gathered(made(todo), sum(job.motions for job in todo), "motions", ShaperFaultError, weigh=len)
    options = {"against": against, "hidden": hidden, "robot": None if robot == "ur5e" else robot}
    result: dict[str, Any] = {
        "command": command("study robustness", **options, calibration=calibration, moves=moves, seed=seed),
        "moves": moves,
        "seed": seed,
        "robot": description.robot.name,
        "calibration": known.name,
        "hidden": hidden or [],
        "shapers": report(methods, [row for rows in done for row in rows], hidden or ()),
    }
    places.write(result, draw=lambda: _figures(result))
    give(result, _print, json=json)


def _figures(result: dict[str, Any]) -> Figures:
    from tvist_lab.figures import robustness_figure

    return {"robustness": robustness_figure(result["shapers"])}


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.robustness import on_terminal

    for kind, shown in on_terminal(result["hidden"]).items():
        title = f"reduction in %, median / p5 over {result['moves']} moves, with wrong {kind}"
        show(title, result["shapers"], shown)

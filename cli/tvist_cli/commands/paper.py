"""`tvist paper`: the paper's experiment."""

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import progress
from tvist_cli.serving import compile_if_new
from tvist_cli.studying import Figures, Places, give
from tvist_cli.tables import print_paper

if TYPE_CHECKING:
    from tvist_lab.studies.paper.experiment import Experiment


def paper(
    *,
    runs: int = 10,
    seed: int = 0,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    calibration: str = "ur5e_5kg",
    baselines: Annotated[bool, Parameter(negative="--no-baselines")] = True,
    json: bool = False,
) -> None:
    """Simulate the paper's three motions, unshaped and shaped, as fast as possible; print its tables beside ours.

    Args:
        runs: Number of repetitions, each with different noise and gear errors.
        seed: Seed of the first repetition.
        figures: Folder to write figures 1 to 4, 7, 8 and 12 to 16 to, and the spectrogram of a ring-down.
        look: How to write the figures.
        calibration: Name of a calibration that comes with the package, or path of a calibration file.
        baselines: Run the baselines for comparison as well.
        json: Print one JSON object.
    """
    places = Places(figures=figures, look=look)
    places.check()
    if runs < 1:
        raise Failure(f"runs is {runs}: must be at least 1", code=2)
    from tvist_lab.in_process import free_setup, robot_in_process
    from tvist_lab.studies.paper.experiment import count, experiment
    from tvist_lab.studies.paper.report import as_dict
    from tvist_server.option_values import StartError

    with told(StartError, code=2):
        setup = free_setup(calibration=calibration, seed=seed)
    compile_if_new()

    async def run() -> "Experiment":
        async with robot_in_process(setup) as robot, robot.control("paper") as arm:
            return await experiment(robot, arm, runs=runs, seed=seed, baselines=baselines, progress=advance)

    with progress(count(runs, baselines=baselines), "motions") as bar:

        def advance(what: str) -> None:
            bar(1, what)

        done = asyncio.run(run())
    result = as_dict(done)
    places.write(result, draw=lambda: _figures(done))
    give(result, print_paper, json=json)


def _figures(done: "Experiment") -> Figures:
    from tvist_lab.paper_drawing import draw

    return draw(done, all_figures=True)

"""`tvist paper`: the paper's experiment."""

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
    robot: str | None = None,
    runs: int = 10,
    seed: int = 0,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    calibration: str | None = None,
    baselines: Annotated[bool, Parameter(negative="--no-baselines")] = True,
    json: bool = False,
) -> None:
    """Simulate the paper's three motions, unshaped and shaped, as fast as possible; print its tables beside ours.

    Args:
        robot: Name of a robot that comes with the package, or path of a robot file, to be the only arm [ur5e, which was
            fitted to Table 1, and ur5e_stiction, which was tuned to Table 2 as well].
        runs: Number of repetitions, each with different noise and gear errors.
        seed: Seed of the first repetition.
        figures: Folder to write figures 1 to 4, 7, 8 and 12 to 16 to, and the spectrogram of a ring-down; those of
            motions are the first arm's.
        look: How to write the figures.
        calibration: Name of a calibration that comes with the package, or path of a calibration file, with polynomials
            [that of each arm]; without --robot, ur5e is then the only arm.
        baselines: Run the baselines for comparison as well, on the first arm.
        json: Print one JSON object.
    """
    places = Places(figures=figures, look=look)
    places.check()
    if runs < 1:
        raise Failure(f"runs is {runs}: must be at least 1", code=2)
    from tvist_lab.in_process import free_setup
    from tvist_lab.studies.paper.experiment import count, simulate
    from tvist_lab.studies.paper.published import ARMS
    from tvist_lab.studies.paper.report import as_dict
    from tvist_server.option_values import StartError

    names = ARMS if robot is calibration is None else (robot or ARMS[0],)
    with told(StartError, code=2):
        setups = {name: free_setup(robot=name, calibration=calibration, seed=seed) for name in names}
    compile_if_new()
    wanted = {name: baselines and name == names[0] for name in names}
    with told(code=2), progress(sum(count(runs, baselines=one) for one in wanted.values()), "motions") as bar:
        arms = [
            simulate(setups[name], runs=runs, seed=seed, baselines=one, progress=lambda what: bar(1, what))
            for name, one in wanted.items()
        ]
    first, *others = map(as_dict, arms)
    result = {**first, "others": others}
    places.write(result, draw=lambda: _figures(arms[0]))
    give(result, print_paper, json=json)


def _figures(done: "Experiment") -> Figures:
    from tvist_lab.paper_drawing import draw

    return draw(done, all_figures=True)

"""`tvist study paths`: shape random paths of the tool along the path and joint by joint, and compare."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import out, say, typed, words
from tvist_cli.shapers_of import calibration_of, designing
from tvist_cli.simulated_arm import UNIFORM, disturbed, masses_of, named
from tvist_cli.studying import Figures, Places, check_range, check_seed, command, gathered, give, show

if TYPE_CHECKING:
    from tvist_plant.description import RobotDescription
    from tvist_protocol.calibration import Calibration

ROBOT = "ur5e"
"""The arm."""
CALIBRATION = "ur5e_modal"
"""Its calibration unless another one is named; it is valid for any payload."""


def paths(
    *,
    random: int = 200,
    kind: Literal["line", "arc", "blends"] | None = None,
    shapers: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    payload: str = UNIFORM,
    calibration: str = CALIBRATION,
    seed: int = 0,
    clean: bool = False,
    disturbances: str | None = None,
    markdown: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Simulate random paths of a UR5e's tool, each shaped along the path and joint by joint, and compare.

    Lines, arcs and chains of 3 to 5 lines with blends take turns, with speeds of 0.1 to 1 m/s and accelerations of 0.5
    to 3 m/s². They begin at postures away from singular ones. Paths that the robot would refuse, or that have to stop
    at a corner, are replaced. The controller knows the payload. Reported are the vibration after the stop and during
    the motion, the delay, and how far the shaped reference leaves the path.

    Args:
        random: Number of paths.
        kind: Draw only paths of this kind: line, arc or blends [all].
        shapers: Names of the shapers to compare [those of the catalogue's menu paths, see tvist shapers].
        payload: Mass of the disc on the flange in kg, both carried and declared; uniform draws one for each path, from
            0 to the arm's rating.
        calibration: Name of a calibration that comes with the package, or path of a calibration file.
        seed: Seed of paths, payloads and gear errors.
        clean: Simulate without nonlinear friction, gear errors and noise.
        disturbances: Disturbances to simulate, separated by commas: friction, gear, noise, or none [all].
        markdown: File to write the tables to.
        figures: Folder to write figures to.
        look: How to write the figures.
        json: Print one JSON object.
    """
    from tvist_lab.studies.path_examples import circle
    from tvist_lab.studies.paths import SHAPERS, PathJob, PathsError, compare, page_of, report
    from tvist_lab.studies.random_paths import KINDS
    from tvist_lab.study.recipes import Recipe
    from tvist_lab.study.shaping import ShaperFaultError
    from tvist_plant.description import load

    places = Places(markdown=markdown, figures=figures, look=look)
    places.check()
    check_range("random", random, 1, 100_000)
    check_seed(seed, bits=63)
    description, known = load(ROBOT), calibration_of(calibration)
    masses = masses_of(payload, description)
    chosen = tuple(dict.fromkeys(name.lower() for name in shapers)) if shapers else SHAPERS
    plant, kept = disturbed(description, disturbances, clean=clean)
    for name in chosen:
        recipe = Recipe(name, known)
        with designing():
            recipe.elastic(plant, recipe.make(plant, 0.0))
    kinds = KINDS if kind is None else (kind,)
    jobs = [PathJob(plant, known, chosen, masses, seed, place, kinds) for place in range(random)]
    judged = gathered(compare(jobs), len(jobs), "paths", PathsError, ShaperFaultError)
    options = {
        "random": random,
        "seed": seed,
        "kind": kind,
        "shapers": shapers,
        "payload": None if payload == UNIFORM else payload,
        "calibration": None if calibration == CALIBRATION else calibration,
        "disturbances": disturbances,
        "clean": clean,
    }
    result = {
        "command": command("study paths", **options),
        "calibration": known.name,
        "payload_kg": list(masses),
        "plant": named(kept),
        "disturbances": list(kept),
        "seed": seed,
        "circle": circle(plant, known),
        **report(judged),
    }
    places.write(
        result, page=lambda: page_of(result, typed()), draw=lambda: _figures(result["paths"], plant, known)
    )
    give(result, _print, json=json)


def _figures(paths: list[dict[str, Any]], description: "RobotDescription", known: "Calibration") -> Figures:
    from tvist_lab.figures import corner_figure, path_shaping_figure
    from tvist_lab.studies.path_examples import corner

    return {
        "path_shaping": path_shaping_figure(paths),
        "path_corner": corner_figure(corner(description, known)),
    }


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.path_examples import circle_in_words
    from tvist_lab.studies.paths import COLUMNS, TERMS, rows, title_of
    from tvist_lab.words import counted

    for kind, group in result["summary"].items():
        if kind != "all":
            show(f"{title_of(kind, group)}; arm {result['plant']}", rows(group), COLUMNS)
    words(TERMS)
    out.print(circle_in_words(result["circle"]), soft_wrap=True)
    refused = result["refused"]
    say(
        f"{counted(refused, 'drawn path')} {'was' if refused == 1 else 'were'} refused by the planner, and "
        f"{result['stopping']} would have stopped on the way; they were replaced"
    )

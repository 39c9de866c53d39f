"""`tvist study paths`: shape random paths of the tool along the path and joint by joint, and compare."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from tvist_cli.failure import told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import out, print_json, progress, say, table, typed, words
from tvist_cli.simulated_arm import UNIFORM, check_count, check_seed, disturbed, masses_of, named

if TYPE_CHECKING:
    from tvist_lab.figures import FigureFiles
    from tvist_lab.studies.paths import JudgedPath, PathJob
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
    from tvist_lab.studies.path_report import page_of, report
    from tvist_lab.studies.paths import SHAPERS, PathJob
    from tvist_lab.studies.random_paths import KINDS
    from tvist_plant.description import load

    look.check(figures, markdown)
    check_count("random", random, 100_000)
    check_seed(seed, bits=63)
    description, known = load(ROBOT), _calibration(calibration)
    masses = masses_of(payload, description)
    chosen = tuple(dict.fromkeys(name.lower() for name in shapers)) if shapers else SHAPERS
    plant, kept = disturbed(description, disturbances, clean=clean)
    _try_out(chosen, known, plant)
    kinds = KINDS if kind is None else (kind,)
    jobs = [PathJob(plant, known, chosen, masses, seed, place, kinds) for place in range(random)]
    judged = _judged(jobs)
    result = {
        "command": _command(random, kind, shapers, payload, calibration, seed, disturbances, clean=clean),
        "calibration": known.name,
        "payload_kg": list(masses),
        "plant": named(kept),
        "disturbances": list(kept),
        "seed": seed,
        "circle": circle(plant, known),
        **report(judged),
    }
    with told(OSError):
        if markdown is not None:
            markdown.write_text(page_of(result, typed()), encoding="utf-8")
        if figures is not None:
            _draw(result["paths"], plant, known, look.into(figures))
    if json:
        print_json(result)
    else:
        _print(result)


def _calibration(name: str) -> "Calibration":
    from tvist_controller.calibrations import load
    from tvist_protocol.calibration import CalibrationError

    with told(CalibrationError, code=2):
        return load(name)


def _try_out(shapers: tuple[str, ...], known: "Calibration", description: "RobotDescription") -> None:
    """Refuse shapers that do not exist, and a calibration of another arm."""
    from tvist_controller.refusal import RefusalError
    from tvist_lab.study.recipes import Recipe, RecipeError
    from tvist_shaping.errors import ShapingError

    for name in shapers:
        with told(RecipeError, RefusalError, ShapingError, code=2):
            Recipe(name, known).make(description, 0.0)


def _judged(jobs: "list[PathJob]") -> "list[JudgedPath]":
    from tvist_lab.studies.paths import PathsError, compare
    from tvist_lab.study.shaping import ShaperFaultError

    judged: list[JudgedPath] = []
    with progress(len(jobs), "paths") as bar, told(PathsError, ShaperFaultError):
        for one in compare(jobs):
            judged.append(one)
            bar(1, None)
    return judged


def _command(
    random: int,
    kind: str | None,
    shapers: list[str] | None,
    payload: str,
    calibration: str,
    seed: int,
    disturbances: str | None,
    *,
    clean: bool,
) -> str:
    """The command that gives the same figures."""
    return " ".join(
        ["tvist", "study", "paths", "--random", str(random), "--seed", str(seed)]
        + ([] if kind is None else ["--kind", kind])
        + ([] if shapers is None else ["--shapers", *shapers])
        + ([] if payload == UNIFORM else ["--payload", payload])
        + ([] if calibration == CALIBRATION else ["--calibration", calibration])
        + ([] if disturbances is None else ["--disturbances", disturbances])
        + (["--clean"] if clean else [])
    )


def _draw(
    paths: list[dict[str, Any]], description: "RobotDescription", known: "Calibration", files: "FigureFiles"
) -> None:
    from tvist_lab.figures import corner_figure, path_shaping_figure
    from tvist_lab.studies.path_examples import corner

    figures = {
        "path_shaping": path_shaping_figure(paths),
        "path_corner": corner_figure(corner(description, known)),
    }
    write(files, figures)


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.path_report import COLUMNS, TERMS, circle_in_words, rows, title_of
    from tvist_lab.study.tables import cells, titles

    for kind, group in result["summary"].items():
        if kind != "all":
            table(
                f"{title_of(kind, group)}; arm {result['plant']}",
                titles(COLUMNS),
                cells(rows(group), COLUMNS),
            )
    words(TERMS)
    out.print(circle_in_words(result["circle"]), soft_wrap=True)
    say(
        f"{result['refused']} drawn paths were refused by the planner, and {result['stopping']} would have stopped on "
        "their way; they were replaced"
    )

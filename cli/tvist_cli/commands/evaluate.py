"""`tvist evaluate`: run any moves unshaped and shaped, and compare."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.evaluated import print_evaluation
from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import print_json, progress, typed
from tvist_cli.report_file import write_report
from tvist_cli.shapers_of import calibration_for, loaded
from tvist_cli.simulated_arm import check_count, check_seed, disturbed, masses_of, named

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_controller.own_shapers import OwnShaper
    from tvist_lab.figures import FigureFiles
    from tvist_lab.studies.evaluate import Rows
    from tvist_lab.study.case import Case
    from tvist_lab.study.method import Method
    from tvist_lab.study.moves import Move
    from tvist_lab.study.work import Job
    from tvist_plant.description import RobotDescription
    from tvist_protocol.calibration import Calibration


def evaluate(
    *,
    moves: Path | None = None,
    random: int | None = None,
    payload: str | None = None,
    shaper: str = "zv",
    modes: int = 1,
    calibration: str | None = None,
    robot: str = "ur5e",
    seed: int = 0,
    wrists: bool = False,
    clean: bool = False,
    disturbances: str | None = None,
    frequency_error: float = 0.0,
    payload_error: float = 0.0,
    stiffness_error: float = 0.0,
    limits: str = "gentle",
    stroke: tuple[float, float] | None = None,
    streams: bool = False,
    baselines: Annotated[bool, Parameter(negative="--no-baselines")] = True,
    save_moves: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Simulate moves unshaped and shaped, as fast as possible, and report the vibration after each.

    The moves come from a file or are drawn at random. The controller knows the payload. The shaper is compared with
    these baselines: waiting, a slower motion of the same duration, ZV frozen at the target, and fixed MZV, EI2 and EI3
    designed for the whole workspace.

    Args:
        moves: JSON file with a list of maps with start and target, one angle per joint, and optionally payload in kg.
        random: Number of moves to draw instead: over the workspace, 30 to 100 % of the way between two
            configurations, and free of collisions.
        payload: Mass of the disc on the flange in kg, both carried and declared; uniform draws one for each move, from
            0 to the arm's rating [that of the robot file; 5 for the ur5e].
        shaper: Any name that tvist shapers lists, such as zv, auto, or elastic; auto-target is given the target of each
            move. Or FILE.py:NAME, which runs that file, for your own shaper.
        modes: Number of modes that the shaper suppresses; more than one needs a modal calibration.
        calibration: Name of a calibration that comes with the package, or path of a calibration file
            [the one that comes with the package for this robot; for several modes, its modal one].
        robot: Name of a robot that comes with the package, or path of a robot file.
        seed: Seed of random moves, payloads and gear errors.
        wrists: Let random moves turn the two outer wrist joints as well.
        clean: Simulate without nonlinear friction, gear errors and noise.
        disturbances: Disturbances to simulate, separated by commas: friction, gear, noise, or none [all].
        frequency_error: Percentage by which the controller overestimates every frequency.
        payload_error: Percentage by which the declared mass exceeds the carried one.
        stiffness_error: Percentage by which each gear, link and velocity loop of the arm is stiffer or softer, at
            random, than the controller knows.
        limits: gentle for the paper's limits, 1.5 rad/s, 2 rad/s² and 100 rad/s³; or industrial for 3 rad/s, 8 rad/s²
            and 2000 rad/s³. Moves for which the drives are too weak are left out.
        stroke: Smallest and largest length of random moves, as a share of the way between two configurations [0.3 1].
        streams: Follow a stream of set-points from the start of each move, which turns to other targets on the way and
            is then stopped, instead of making the move.
        baselines: Run the baselines as well; this takes three and a half times as long.
        save_moves: File to write the moves and their payloads to.
        figures: Folder to write figures to.
        look: How to write the figures.
        report: File to write a web page with the verdict, the tables and the figures to.
        json: Print one JSON object.
    """
    from tvist_lab.studies.evaluate import MEASURED, methods
    from tvist_lab.studies.evaluate import notes as notes_of
    from tvist_lab.studies.evaluate import report as summary
    from tvist_lab.study.case import arm_seed
    from tvist_lab.study.moves import collisions, write_moves
    from tvist_lab.study.work import Job
    from tvist_plant.description import DescriptionError, load

    look.check(figures, save_moves, report)
    _check(moves, random, seed, modes, frequency_error, wrists=wrists)
    _check_conditions(limits, payload_error, stiffness_error)
    length = _stroke(stroke, moves)
    if streams and save_moves is not None:
        raise Failure("--save-moves writes moves, but --streams follows streams: leave one out", code=2)
    with told(DescriptionError, code=2):
        description = load(robot)
    masses = masses_of(payload, description)
    shaper, own = loaded(shaper)
    known = calibration_for(calibration, shaper, own, modes, description)
    chosen, share = _moves(moves, random, seed, masses, description, length, wrists=wrists)
    plant, kept = disturbed(description, disturbances, clean=clean)
    wanted = len(chosen)
    if not streams:
        chosen = _feasible(chosen, description, limits)
    mine, others = _methods(shaper, own, modes, known, plant, frequency_error, masses, baselines=baselines)
    if streams:  # the end of a stream is not known
        others = [one for one in others if not one.told_target]
    conditions = (limits, payload_error, stiffness_error)
    jobs = [
        Job(
            _case(plant, move, arm_seed(seed, place), *conditions, stream=streams),
            methods(mine, others),
            MEASURED,
        )
        for place, move in enumerate(chosen)
    ]
    with told(OSError):
        if save_moves is not None:
            write_moves(save_moves, chosen)
        judged = _judged(jobs, shaper)
    met = collisions(description, chosen) if moves is not None and not streams else []
    result = {
        "shaper": shaper,
        "calibration": None if known is None else known.name,
        "plant": named(kept),
        "disturbances": list(kept),
        "seed": seed,
        "limits": limits,
        "streams": streams,
        "payload_error_percent": payload_error,
        "stiffness_error_percent": stiffness_error,
        "free_of_collision": share,
        **summary(judged),
    }
    result["notes"] = notes_of(result, met, known, chosen, share, wanted)
    if baselines and not others:
        result["notes"].append("there are no baselines: they need a calibration of this arm")
    if figures is not None or report is not None:
        _show(result, _drawn(jobs, judged), None if figures is None else look.into(figures), report)
    if json:
        print_json(result)
    else:
        print_evaluation(result)


def _judged(jobs: list["Job"], shaper: str) -> "list[Rows]":
    """The rows of each move.

    Raises:
        Failure: The shaper's function fails.
    """
    from tvist_lab.study.engine import made
    from tvist_lab.study.shaping import ShaperFaultError

    judged: list[Rows] = []
    with progress(sum(job.motions for job in jobs), "motions") as bar:
        try:
            for rows in made(jobs):
                judged.append(rows)
                bar(len(rows), None)
        except ShaperFaultError as fault:
            raise Failure(f"shaper {shaper} {fault}") from fault
    return judged


def _check(
    moves: Path | None, random: int | None, seed: int, modes: int, frequency_error: float, *, wrists: bool
) -> None:
    if (moves is None) == (random is None):
        raise Failure("give either --moves FILE or --random N", code=2)
    if wrists and moves is not None:
        raise Failure("--wrists needs --random: it does not change the moves of a file", code=2)
    if random is not None:
        check_count("random", random, 100_000)
    check_seed(seed, bits=63)
    if not 1 <= modes <= 6:
        raise Failure(f"modes is {modes}: must be 1 to 6", code=2)
    if not -90.0 <= frequency_error <= 900.0:
        raise Failure(f"frequency-error is {frequency_error:g} %: must be -90 to 900 %", code=2)


def _check_conditions(limits: str, payload_error: float, stiffness_error: float) -> None:
    from tvist_lab.study.case import LIMITS

    if limits not in LIMITS:
        raise Failure(f"limits is {limits!r}: must be {' or '.join(LIMITS)}", code=2)
    if not -100.0 <= payload_error <= 900.0:
        raise Failure(f"payload-error is {payload_error:g} %: must be -100 to 900 %", code=2)
    if not 0.0 <= stiffness_error <= 90.0:
        raise Failure(f"stiffness-error is {stiffness_error:g} %: must be 0 to 90 %", code=2)


def _case(
    plant: "RobotDescription",
    move: "Move",
    seed: int,
    limits: str,
    payload_error: float,
    stiffness_error: float,
    *,
    stream: bool,
) -> "Case":
    from tvist_lab.study.arms import scattered
    from tvist_lab.study.case import LIMITS, Case

    arms, axes = (scattered(0.01 * stiffness_error),), {"payload_kg": move.mass}
    return Case(plant, move, seed, arms, LIMITS[limits], 0.01 * payload_error, stream, axes)


def _stroke(stroke: tuple[float, float] | None, moves: Path | None) -> tuple[float, float]:
    from tvist_lab.study.moves import STROKE

    if stroke is None:
        return STROKE
    if moves is not None:
        raise Failure("--stroke needs --random: it does not change the moves of a file", code=2)
    low, high = stroke
    if not 0.001 <= low <= high <= 1.0:
        raise Failure(f"stroke is {low:g} {high:g}: must be two increasing shares of 0.001 to 1", code=2)
    return stroke


def _feasible(moves: list["Move"], description: "RobotDescription", limits: str) -> list["Move"]:
    """Return the moves for which the drives are strong enough.

    Raises:
        Failure: There are none.
    """
    from tvist_lab.study.case import LIMITS, Case

    found = [move for move in moves if Case(description, move, limits=LIMITS[limits]).torque_share <= 1.0]
    if not found:
        raise Failure("the drives are too weak for all of these moves at these limits", code=2)
    return found


def _moves(
    path: Path | None,
    count: int | None,
    seed: int,
    masses: tuple[float, float],
    description: "RobotDescription",
    stroke: tuple[float, float],
    *,
    wrists: bool,
) -> tuple[list["Move"], float | None]:
    """The moves, and the share of draws that were free of collision."""
    import numpy as np

    from tvist_lab.study.moves import MovesError, draw_moves, read_moves

    with told(MovesError, code=2):
        if path is not None:
            drawn_masses = np.random.default_rng(seed)
            return read_moves(path, description, lambda: float(drawn_masses.uniform(*masses))), None
        assert count is not None
        drawn = draw_moves(description, count, seed, masses, wrists=wrists, stroke=stroke)
    return drawn.moves, drawn.share


def _methods(
    shaper: str,
    own: "tuple[OwnShaper, ...]",
    modes: int,
    known: "Calibration | None",
    description: "RobotDescription",
    frequency_error: float,
    masses: tuple[float, float],
    *,
    baselines: bool,
) -> "tuple[Method, list[Method]]":
    """The shaper, tried out, and the baselines."""
    from tvist_controller.refusal import RefusalError
    from tvist_lab.study.catalogue import baselines as every
    from tvist_lab.study.method import Named
    from tvist_lab.study.recipes import Recipe, RecipeError
    from tvist_shaping.errors import ShapingError

    recipe = Recipe(shaper, known, 0.01 * frequency_error, modes, own)
    with told(RecipeError, RefusalError, ShapingError, code=2):
        recipe.elastic(description, recipe.make(description, masses[1]))
        # Without a calibration of the arm, no baseline can be designed for it.
        others = every(recipe, description, masses) if baselines and known is not None else []
        return Named(recipe, shaper), others


def _show(
    result: dict[str, Any],
    drawn: dict[str, tuple["Figure", str]],
    files: "FigureFiles | None",
    report: Path | None,
) -> None:
    with told(OSError):
        if files is not None:
            write(files, {name: figure for name, (figure, _) in drawn.items()})
        if report is not None:
            from tvist_lab.report import evaluation_page

            pictures = {caption: figure for figure, caption in drawn.values()}
            write_report(report, evaluation_page(result, pictures, typed()))


def _drawn(jobs: list["Job"], judged: list["Rows"]) -> dict[str, tuple["Figure", str]]:
    """Figures by the names of their files, each with a caption."""
    from tvist_lab.figures import residual_by_move_figure, vibration_figure
    from tvist_lab.studies.evaluate import example
    from tvist_lab.study.work import record

    middle = example(judged)
    every = residual_by_move_figure([rows[0] for rows in judged])
    one = vibration_figure(*record(jobs[middle]), middle + 1)
    return {
        "moves": (every, "Vibration after each move, unshaped and shaped."),
        "one_move": (one, f"Move {middle + 1}, which vibrates like the median of all moves."),
    }

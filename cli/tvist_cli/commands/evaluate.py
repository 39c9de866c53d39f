"""`tvist evaluate`: run any moves unshaped and shaped, and compare."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.offered import PLANTS, ROBOTS, SHAPERS
from tvist_cli.output import number, out, say, typed
from tvist_cli.shapers_of import calibration_for, designing, loaded
from tvist_cli.simulated_arm import disturbed, limits_of, masses_of, named, plants_of
from tvist_cli.studying import Figures, Places, check_range, check_seed, gathered, give, show

if TYPE_CHECKING:
    from tvist_lab.report import Page
    from tvist_lab.studies.evaluate import Rows
    from tvist_lab.study.method import Method
    from tvist_lab.study.moves import Move
    from tvist_lab.study.recipes import Recipe
    from tvist_lab.study.work import Job
    from tvist_plant.description import RobotDescription
    from tvist_plant.variants import Variant

LISTED = 12
"""Largest number of moves that are printed one by one."""


def evaluate(
    *,
    moves: Path | None = None,
    random: int | None = None,
    payload: str | None = None,
    shaper: Annotated[str, SHAPERS] = "zv",
    modes: int = 1,
    calibration: str | None = None,
    robot: Annotated[str, ROBOTS] = "ur5e",
    seed: int = 0,
    wrists: bool = False,
    clean: bool = False,
    disturbances: str | None = None,
    frequency_error: float = 0.0,
    payload_error: float = 0.0,
    stiffness_error: float = 0.0,
    plant: Annotated[str | None, PLANTS] = None,
    hidden: int | None = None,
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
        plant: An arm with something that the controller does not know, such as stribeck, hysteresis, torsion, base,
            backlash, combined, springs-30 or springs+30 [as described].
        hidden: Seed of a hidden robot: an arm whose springs, dampers, loops, rotors, friction and payload are drawn
            from it.
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
    from tvist_lab.studies.evaluate import feasible, jobs, notes
    from tvist_lab.studies.evaluate import report as summary
    from tvist_lab.study.moves import collisions, write_moves
    from tvist_lab.study.recipes import Recipe
    from tvist_plant.description import DescriptionError, load

    places = Places(figures=figures, look=look, report=report)
    places.check(save_moves)
    if (moves is None) == (random is None):
        raise Failure("give either --moves FILE or --random N", code=2)
    _check(seed, modes, frequency_error, payload_error, stiffness_error)
    of_moves = limits_of(limits)
    if streams and save_moves is not None:
        raise Failure("--save-moves writes moves, but --streams follows streams: leave one out", code=2)
    with told(DescriptionError, code=2):
        description = load(robot)
    variant = _variant(stiffness_error, plant, hidden, description)
    masses = masses_of(payload, description)
    shaper, own = loaded(shaper)
    known = calibration_for(calibration, shaper, own, modes, description)
    if moves is not None:
        chosen, share = _read(moves, seed, masses, description, wrists=wrists, stroke=stroke), None
    else:
        chosen, share = _drawn(random or 0, seed, masses, description, wrists=wrists, stroke=stroke)
    arm, kept = disturbed(description, disturbances, clean=clean)
    wanted = len(chosen)
    if not streams:
        chosen = feasible(chosen, description, of_moves)
        if not chosen:
            raise Failure("the drives are too weak for all of these moves at these limits", code=2)
    recipe = Recipe(shaper, known, 0.01 * frequency_error, modes, own)
    mine, others = _methods(recipe, arm, masses, baselines=baselines)
    if streams:  # the end of a stream is not known
        others = [one for one in others if not one.told_target]
    todo = jobs(
        arm,
        chosen,
        seed,
        mine,
        others,
        limits=of_moves,
        payload_error=0.01 * payload_error,
        arm=variant,
        streams=streams,
    )
    if save_moves is not None:
        with told(OSError):
            write_moves(save_moves, chosen)
    judged = _judged(todo, shaper)
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
        "variant": variant.name,
        "free_of_collision": share,
        **summary(judged),
    }
    result["notes"] = notes(result, met, known, chosen, share, wanted)
    if baselines and not others:
        result["notes"].append("there are no baselines: they need a calibration of this arm")
    places.write(
        result, draw=lambda: _figures(result, todo, judged), web_page=lambda drawn: _web_page(result, drawn)
    )
    give(result, _print, json=json)


def _check(
    seed: int, modes: int, frequency_error: float, payload_error: float, stiffness_error: float
) -> None:
    check_seed(seed, bits=63)
    check_range("modes", modes, 1, 6)
    check_range("frequency-error", frequency_error, -90.0, 900.0, " %")
    check_range("payload-error", payload_error, -100.0, 900.0, " %")
    check_range("stiffness-error", stiffness_error, 0.0, 90.0, " %")


def _variant(
    stiffness_error: float, plant: str | None, hidden: int | None, description: "RobotDescription"
) -> "Variant":
    """The arm as it is, of which the controller knows the description."""
    from tvist_lab.study.arms import scattered

    if sum((stiffness_error != 0.0, plant is not None, hidden is not None)) > 1:
        raise Failure("give one of --stiffness-error, --plant and --hidden", code=2)
    if plant is None and hidden is None:
        return scattered(0.01 * stiffness_error)
    found = plants_of([] if plant is None else [plant], [] if hidden is None else [hidden], description)
    return found[0]


def _methods(
    recipe: "Recipe", description: "RobotDescription", masses: tuple[float, float], *, baselines: bool
) -> "tuple[Method, list[Method]]":
    """The shaper, tried out, and the baselines; without a calibration of the arm, none can be designed for it."""
    from tvist_lab.study.catalogue import baselines as every
    from tvist_lab.study.method import Named

    with designing():
        recipe.elastic(description, recipe.make(description, masses[1]))
        others = every(recipe, description, masses) if baselines and recipe.calibration else []
    return Named(recipe, recipe.shaper), others


def _judged(jobs: list["Job"], shaper: str) -> "list[Rows]":
    """The rows of each move."""
    from tvist_lab.study.engine import made
    from tvist_lab.study.shaping import ShaperFaultError

    try:
        return gathered(made(jobs), sum(job.motions for job in jobs), "motions", weigh=len)
    except ShaperFaultError as fault:
        raise Failure(f"shaper {shaper} {fault}") from fault


def _read(
    path: Path,
    seed: int,
    masses: tuple[float, float],
    description: "RobotDescription",
    *,
    wrists: bool,
    stroke: tuple[float, float] | None,
) -> list["Move"]:
    """The moves of a file, to which options about random moves do not apply."""
    import numpy as np

    from tvist_lab.study.moves import MovesError, read_moves

    for name, given in (("wrists", wrists), ("stroke", stroke is not None)):
        if given:
            raise Failure(f"--{name} needs --random: it does not change the moves of a file", code=2)
    drawn = np.random.default_rng(seed)
    with told(MovesError, code=2):
        return read_moves(path, description, lambda: float(drawn.uniform(*masses)))


def _drawn(
    count: int,
    seed: int,
    masses: tuple[float, float],
    description: "RobotDescription",
    *,
    wrists: bool,
    stroke: tuple[float, float] | None,
) -> tuple[list["Move"], float]:
    """Random moves, and the share of draws that were free of collision."""
    from tvist_lab.study.moves import STROKE, MovesError, draw_moves

    check_range("random", count, 1, 100_000)
    low, high = stroke or STROKE
    if not 0.001 <= low <= high <= 1.0:
        raise Failure(f"stroke is {low:g} {high:g}: must be two increasing shares of 0.001 to 1", code=2)
    with told(MovesError, code=2):
        drawn = draw_moves(description, count, seed, masses, wrists=wrists, stroke=(low, high))
    return drawn.moves, drawn.share


def _figures(result: dict[str, Any], jobs: list["Job"], judged: "Sequence[Rows]") -> Figures:
    from tvist_lab.figures import residual_by_move_figure, vibration_figure
    from tvist_lab.studies.evaluate import example
    from tvist_lab.study.work import record

    middle = example(result["moves"])
    return {
        "moves": residual_by_move_figure([rows[0] for rows in judged]),
        "one_move": vibration_figure(*record(jobs[middle]), middle + 1),
    }


def _web_page(result: dict[str, Any], drawn: Figures) -> "Page":
    from tvist_lab.report import evaluation_page

    return evaluation_page(result, drawn, typed())


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.evaluate import MOVES, WAYS

    if len(result["moves"]) <= LISTED:
        moves = [{"place": place, **move} for place, move in enumerate(result["moves"], 1)]
        show(f"moves with shaper {result['shaper']}", moves, MOVES)
    ways = {result["shaper"]: result, **result["baselines"]}
    entries = [{"name": name, **way} for name, way in ways.items()]
    told = result["stiffness_error_percent"] or result["variant"] == "calibrated"
    known = f"arm {result['plant']}" + ("" if told else f", plant {result['variant']}")
    show(f"{result['counted']} moves, {known}", entries, WAYS)
    median, p5 = (result["reduction_percent_interval"][name] for name in ("median", "p5"))
    if median is not None:
        out.print(
            f"95 % intervals (bootstrap): median {median[0]:.1f} to {median[1]:.1f} %, p5 {p5[0]:.1f} to {p5[1]:.1f} %"
        )
        peaks = [(name, way["peak_m_s2"]) for name, way in list(ways.items())[:2]]
        said = (f"{name} {number(peak['median'])} (p95 {number(peak['p95'])})" for name, peak in peaks)
        out.print(f"peaks in m/s², median: {', '.join(said)}")
    quiet = ", ".join(
        f"{name} {number(way['quiet_after_unshaped_stop_ms']['median'], 0)}" for name, way in ways.items()
    )
    out.print(f"still at 0.02 m/s² after, in ms, median: {quiet}")
    out.print("¹ last time |α| exceeds 0.1 m/s², median, from the stop of the unshaped reference")
    out.print("² less than an unshaped arm that waits equally long still vibrates")
    for note in result["notes"]:
        say(note)

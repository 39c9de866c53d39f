"""`tvist shaperbench`: rank shapers, your own included, on fifteen simulated arms."""

from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.offered import COMPARED, ROBOTS
from tvist_cli.output import out, say
from tvist_cli.shapers_of import load_given, modal_for, on_the_bench
from tvist_cli.simulated_arm import plants_of
from tvist_cli.studying import Figures, Places, check_range, check_seed, command, gathered, give, show

if TYPE_CHECKING:
    from tvist_controller.sources.own_shapers import OwnShaper
    from tvist_lab.report import Page

QUICK = 3
"""Number of moves with --quick."""


def shaperbench(
    *,
    shaper: str | None = None,
    quick: bool = False,
    moves: int | None = None,
    against: Annotated[list[str] | None, COMPARED, Parameter(consume_multiple=True)] = None,
    hidden: Annotated[list[int] | None, Parameter(consume_multiple=True)] = None,
    robot: Annotated[str, ROBOTS] = "ur5e",
    seed: int = 0,
    calibration: str | None = None,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Rank shapers by how soon fifteen different arms come to rest, and by the vibration until then.

    Every shaper gets the same random moves with payloads up to the robot's rating, of which the controller assumes 100,
    110 and 90 %. Fifteen arms follow its reference; all but two differ from the controller's model. The motors of two
    stick: their controller has the robot file and the calibration of ur5e_stiction. A shaper that uses future samples
    or does not report its full delay is listed but not ranked.

    Args:
        shaper: Python file with a class that has step(q_ref, info) -> q_star, and optionally reset(q) and delay in s;
            or with a function step. Or FILE.py:NAME, as for tvist serve.
        quick: Run only a few moves, with one payload error each.
        moves: Number of moves [60, or 3 with --quick].
        against: Names of the shapers and baselines to run, in addition to waiting; default: all.
        hidden: Seeds of hidden robots, each of which is one more arm: its springs, dampers, loops, rotors, friction and
            payload are drawn from its seed.
        robot: Name of a robot that comes with the package, or path of a robot file; if it is not ur5e, the two arms
            whose motors stick are left out.
        seed: Seed of moves, payloads, gear errors and parameter scatter.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; it needs a modal
            model [that of the robot].
        output: JSON file to write the leaderboard to.
        figures: Folder to write figures of settling time against residual vibration and against delay to.
        look: How to write the figures.
        report: File to write a web page with the verdict, the tables and the figures to.
        json: Print one JSON object.
    """
    from tvist_lab.studies import leaderboard
    from tvist_lab.studies import shaperbench as bench
    from tvist_lab.study.arms import ARMS
    from tvist_lab.study.held_out import MOVES

    places = Places(output=output, figures=figures, look=look, report=report)
    places.check()
    count = moves if moves is not None else QUICK if quick else MOVES
    check_range("moves", count, 1, 10_000)
    check_seed(seed)
    description, known = modal_for(calibration, robot)
    against = None if against is None else [name.lower() for name in against]
    mine = None if shaper is None else _mine(shaper)
    methods = on_the_bench(description, known, against, mine)
    arms = [*ARMS, *plants_of([], hidden, description)]
    drawn = bench.draw(description, count, seed)
    ours = len(methods) - (mine is not None)  # what comes with the package is inspected by its tests
    faults = [None] * ours + [bench.inspect(one, description, drawn) for one in methods[ours:]]
    sound = [one for one, fault in zip(methods, faults, strict=True) if fault is None]
    jobs = bench.jobs(description, sound, drawn, seed, quick=quick, arms=arms)
    sticking = bench.STICKING if robot == "ur5e" else ()
    if sticking:
        their, known_of_them = modal_for(None, bench.STICKS)
        like = on_the_bench(their, known_of_them, against, mine)
        ranked = {one.name for one in sound}
        chosen = [one for one in like if one.name in ranked]
        jobs += bench.jobs(their, chosen, drawn, seed, quick=quick, arms=sticking)
    bends = bench.bends(description, sound, drawn)
    work: Any = chain(bench.play(jobs), map(bench.bend, bends))
    found = gathered(work, len(jobs) + len(bends), "motions")
    rows, bent = chain.from_iterable(found[: len(jobs)]), zip(bends, found[len(jobs) :], strict=True)
    options = {
        "shaper": shaper,
        "against": against,
        "hidden": hidden,
        "robot": None if robot == "ur5e" else robot,
        "calibration": calibration,
        "quick": quick,
    }
    result = {
        "date": datetime.now(UTC).date().isoformat(),
        "command": command("shaperbench", **options, moves=count, seed=seed),
        "moves": count,
        "seed": seed,
        "robot": description.robot.name,
        "payload_errors": list(bench.PAYLOAD_ERRORS),
        "arms": {arm.name: arm.label for arm in (*arms, *sticking)},
        "calibration": known.name,
        **leaderboard.leaderboard(methods, faults, list(rows), list(bent)),
    }
    places.write(
        result,
        draw=lambda: _figures(result),
        web_page=lambda drawn: _web_page(result, drawn),
    )
    give(result, _print, json=json)
    place = getattr(mine, "place", shaper)
    unranked = next((row for row in result["shapers"] if row["label"] == place and not row["ranked"]), None)
    if unranked is not None:
        raise Failure(f"shaper {shaper} is not ranked: it {unranked['fault']}")


def _mine(shaper: str) -> "str | OwnShaper":
    """Check the user's own shaper: the path of a file with a method or function step, or FILE.py:NAME."""
    if ".py:" in shaper:
        return load_given(shaper)
    from tvist_lab.study.foreign import CandidateError, load_shaper

    with told(CandidateError, code=2):
        load_shaper(Path(shaper))
    return shaper


def _figures(result: dict[str, Any]) -> Figures:
    from tvist_lab.figures import pareto_figure, settling_figure

    shapers = result["shapers"]
    return {"pareto": pareto_figure(shapers), "settling_measured": settling_figure(shapers)}


def _web_page(result: dict[str, Any], drawn: Figures) -> "Page":
    from tvist_lab.report import shaperbench_page

    return shaperbench_page(result, drawn)


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.leaderboard import ON_TERMINAL, ranked

    errors = len(result["payload_errors"])
    show(
        f"{result['moves']} moves on {len(result['arms'])} arms with {errors} payload errors; "
        "* keeps the limits, and no other shaper that keeps them is better in both still and ring",
        ranked(result),
        ON_TERMINAL,
    )
    out.print(
        "still: last time |α| exceeds 0.1 m/s², from the stop of the unshaped reference, median and p90;\n"
        "ring: envelope within 3 to 60 Hz after the shaper's own stop; less: reduction compared with waiting;\n"
        "worst arm: the arm with the smallest median of it;\n"
        "moving: vibration during the motion relative to waiting; q̈ and q̇: largest peaks;\n"
        "bend: deviation from a path round a corner; µs: time per tick on this machine, including its estimates.",
        markup=False,
    )
    told = [row["name"] for row in result["shapers"] if row["ranked"] and row["told_target"]]
    if told:
        say(f"these shapers are given the target before each move: {', '.join(told)}")
    for row in result["shapers"]:
        if not row["ranked"]:
            say(f"{row['name']} ({row['label']}) is not ranked: it {row['fault']}")

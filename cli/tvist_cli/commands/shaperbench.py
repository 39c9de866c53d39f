"""`tvist shaperbench`: rank shapers, your own included, on ten simulated arms."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import out, print_json, progress, say, table, typed, write_json
from tvist_cli.report_file import write_report
from tvist_cli.shapers_of import load_given
from tvist_cli.simulated_arm import check_count, check_seed

if TYPE_CHECKING:
    from tvist_controller.own_shapers import OwnShaper
    from tvist_lab.study.method import Method
    from tvist_lab.study.work import Row
    from tvist_protocol.calibration import Calibration

MOVES = 100
QUICK = 3
"""Number of moves with --quick."""
CALIBRATION = "ur5e_modal"
"""Calibration of the bench's arm, unless another one is named."""


def shaperbench(
    *,
    shaper: str | None = None,
    quick: bool = False,
    moves: int | None = None,
    against: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    seed: int = 0,
    calibration: str | None = None,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    markdown: Path | None = None,
    report: Path | None = None,
    json: bool = False,
) -> None:
    """Rank shapers by how soon ten different arms come to rest, and by the vibration until then.

    Every shaper gets the same random moves with payloads of 0 to 5 kg, of which the controller assumes 100, 110 and
    90 %. Ten arms follow its reference; all but one differ from the controller's model. A shaper that uses future
    samples or does not report its full delay is listed but not ranked.

    Args:
        shaper: Python file with a class that has step(q_ref, info) -> q_star, and optionally reset(q) and delay in s;
            or with a function step. Or FILE.py:NAME, as for tvist serve.
        quick: Run only a few moves, with one payload error each.
        moves: Number of moves [100, or 3 with --quick].
        against: Names of the shapers and baselines to run, in addition to waiting; default: all.
        seed: Seed of moves, payloads, gear errors and parameter scatter.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; it needs a modal
            model [ur5e_modal].
        output: JSON file to write the leaderboard to.
        figures: Folder to write figures of settling time against residual vibration and against delay to.
        look: How to write the figures.
        markdown: File to write a page with the tables to.
        report: File to write a web page with the verdict, the tables and the figures to.
        json: Print one JSON object.
    """
    from tvist_lab.studies import curves, leaderboard
    from tvist_lab.studies import shaperbench as bench
    from tvist_lab.study.arms import ARMS
    from tvist_plant.description import load

    look.check(figures, output, markdown, report)
    count = moves if moves is not None else QUICK if quick else MOVES
    check_count("moves", count, 10_000)
    check_seed(seed)
    description = load("ur5e")
    known = modal_calibration(calibration)
    against = None if against is None else [name.lower() for name in against]
    mine = None if shaper is None else _mine(shaper)
    methods = methods_of(mine, against, known)
    drawn = bench.draw(description, count, seed)
    faults = [bench.inspect(one, description, drawn) for one in methods]
    sound = [one for one, fault in zip(methods, faults, strict=True) if fault is None]
    jobs, bends = (
        bench.jobs(description, sound, drawn, seed, quick=quick),
        curves.bends(description, sound, drawn),
    )
    done: list[Row] = []
    bent = []
    with progress(len(jobs) + len(bends), "motions") as bar:
        for rows in bench.play(jobs):
            done += rows
            bar(1, None)
        for path in bends:
            bent.append((path, curves.bend(path)))
            bar(1, None)
    result = {
        "date": datetime.now(UTC).date().isoformat(),
        "command": _command(shaper, against, count, seed, calibration, quick=quick),
        "moves": count,
        "seed": seed,
        "payload_errors": list(bench.PAYLOAD_ERRORS),
        "arms": {arm.name: arm.label for arm in ARMS},
        "calibration": known.name,
        **leaderboard.leaderboard(methods, faults, done, bent),
    }
    _write(result, output, markdown)
    _show(result, figures, look, report)
    if json:
        print_json(result)
    else:
        _print(result)
    place = getattr(mine, "place", shaper)
    unranked = next((row for row in result["shapers"] if row["label"] == place and not row["ranked"]), None)
    if unranked is not None:
        raise Failure(f"shaper {shaper} is not ranked: it {unranked['fault']}")


def modal_calibration(name: str | None) -> "Calibration":
    """Return a calibration with a modal model, by default that of the UR5e.

    Raises:
        Failure: There is no such calibration, or it has no modal model.
    """
    from tvist_controller.calibrations import load
    from tvist_protocol.calibration import CalibrationError

    with told(CalibrationError, code=2):
        known = load(CALIBRATION if name is None else name)
    if known.modal is None:
        raise Failure(
            f"calibration {known.name} has no modal model: make one with tvist identify --model modal", code=2
        )
    return known


def _mine(shaper: str) -> "str | OwnShaper":
    """Check the user's own shaper: the path of a file with a method or function step, or FILE.py:NAME."""
    if ".py:" in shaper:
        return load_given(shaper)
    from tvist_lab.study.foreign import CandidateError, load_shaper

    with told(CandidateError, code=2):
        load_shaper(Path(shaper))
    return shaper


def methods_of(
    mine: "str | OwnShaper | None", against: list[str] | None, known: "Calibration"
) -> "list[Method]":
    """Return waiting and the methods to compare; see `tvist_lab.study.catalogue.bench`.

    Raises:
        Failure: There is no shaper of a name.
    """
    from tvist_lab.study.catalogue import UNSHAPED, bench, names
    from tvist_lab.study.recipes import RecipeError
    from tvist_plant.description import load

    every = {UNSHAPED, *names("bench")}
    for name in against or []:
        if name not in every:
            raise Failure(f"against is {name!r}: must be one of {', '.join(sorted(every))}", code=2)
    with told(RecipeError, code=2):
        return bench(load("ur5e"), known, mine, against)


def _command(
    shaper: str | None,
    against: list[str] | None,
    count: int,
    seed: int,
    calibration: str | None,
    *,
    quick: bool,
) -> str:
    words = ["tvist shaperbench"]
    words += [] if shaper is None else [f"--shaper {shaper}"]
    words += [] if against is None else ["--against", *against]
    words += [] if calibration is None else [f"--calibration {calibration}"]
    words += ["--quick"] if quick else []
    return " ".join([*words, f"--moves {count} --seed {seed}"])


def _write(
    result: dict[str, Any],
    output: Path | None,
    markdown: Path | None,
) -> None:
    with told(OSError):
        if output is not None:
            write_json(output, result)
        if markdown is not None:
            from tvist_lab.studies.bench_tables import ON_PAGE, best_in_bold, ranked
            from tvist_lab.studies.pages import page

            more = {"ranked": ranked(result), "columns": ON_PAGE, "best_in_bold": best_in_bold}
            markdown.write_text(page("shaperbench", result, typed(), **more), encoding="utf-8")


def _show(result: dict[str, Any], figures: Path | None, look: FigureOptions, report: Path | None) -> None:
    if figures is None and report is None:
        return
    from tvist_lab.figures import pareto_figure, settling_figure
    from tvist_lab.report import shaperbench_page

    pareto, settling = pareto_figure(result["shapers"]), settling_figure(result["shapers"])
    if figures is not None:
        write(look.into(figures), {"pareto": pareto, "settling_measured": settling})
    if report is not None:
        captions = {
            "Settling time against residual vibration.": pareto,
            "Settling time against delay.": settling,
        }
        write_report(report, shaperbench_page(result, captions))


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.bench_tables import ON_TERMINAL, ranked
    from tvist_lab.study.tables import cells, titles

    errors = len(result["payload_errors"])
    table(
        f"{result['moves']} moves on {len(result['arms'])} arms with {errors} payload errors; "
        "* keeps the limits, and no other shaper that keeps them is better in both still and ring",
        titles(ON_TERMINAL),
        cells(ranked(result), ON_TERMINAL),
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

"""`tvist demo`: run the paper's experiment on a served robot in real time, or simulate it as fast as possible."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.compiling import compile_if_new
from tvist_cli.failure import Failure, Misuse, check_range, failing_on
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions
from tvist_cli.offered import ROBOTS
from tvist_cli.output import number, out, program, progress, table, words
from tvist_cli.pages import MAGNIFY, serve_page
from tvist_cli.studying import print_result

if TYPE_CHECKING:
    from tvist_lab.studies.paper.served import ServedExperiment

FOLDER = Path("tvist-demo")
ANSWERED = "Q1-Q3"
"""Motion of the overview figure: the arm's frequency doubles during it, and the vibration is easy to see."""
TERMS = {
    "f_d, ζ": "frequency at which the arm vibrates, and its damping ratio: 0 rings for ever, 1 does not swing back",
    "shaped": "the command is split into two, half a period of the vibration apart, so that their vibrations cancel",
    "delay": "how much longer the shaped command takes",
    "stabil.": "time from the tool's first coming within 0.03 mm of where it ends to its staying there",
    "cycle": "time from the start of the motion until the tool stays there",
    "overshoot": "how far the tool leaves that place again in between",
    "RV": "residual vibration: acceleration with which the tool vibrates at the end of the command",
    "impact": "change by shaping",
}
METHOD_TERMS = {
    "peak": "largest true acceleration of the tool later than 10 ms after the end of the command; less: by how much",
    "still": "last time at which it exceeds 0.1 m/s²",
    "q̈/limit": "largest acceleration of a joint over its limit",
}


def demo(
    *,
    output: Path | None = None,
    seed: int = 0,
    tables: bool = False,
    view: bool = False,
    runs: int | None = None,
    robot: Annotated[str | None, ROBOTS] = None,
    calibration: str | None = None,
    baselines: Annotated[bool, Parameter(negative="--no-baselines")] = True,
    look: FigureOptions = DEFAULT_FIGURES,
    json: bool = False,
) -> None:
    """Run the paper's motions unshaped and shaped, once over Zenoh in real time, and print the result.

    With --runs, the motions are simulated as fast as possible instead, and the paper's tables are printed
    beside those of the simulation.

    Args:
        output: Write the recording and figures 12 to 16 to this folder [tvist-demo]. With --runs, write figures 1 to
            4, 7, 8, 12 to 16 and the spectrogram of a ring-down [none]; figures of motions show the first arm.
        seed: Set the seed of sensor noise and gear errors; with --runs, of the first repetition.
        tables: Print the paper's tables beside those of this run as well.
        view: Show the motions afterwards on a web page, with the arm's bending drawn 100 times larger.
        runs: Simulate this number of repetitions as fast as possible, each with other noise and gear errors.
        robot: With --runs, simulate only this arm: the name of a robot that comes with the package, or the
            path of a robot file [ur5e, fitted to Table 1, and ur5e_stiction, tuned to Table 2 as well].
        calibration: With --runs, use this calibration with polynomials: a name that comes with the package,
            or the path of a file [that of each arm]; without --robot, only ur5e is simulated.
        baselines: With --runs, also run the baselines for comparison on the first arm.
        look: How to write the figures.
        json: Print one JSON object with all results.
    """
    if runs is None:
        if robot is not None or calibration is not None or not baselines:
            raise Misuse(
                "--robot, --calibration and --no-baselines are for --runs: give it, or leave them out"
            )
        _in_real_time(FOLDER if output is None else output, seed, look, tables=tables, view=view, json=json)
        return
    if view:
        raise Misuse("--view shows what was recorded in real time: leave --runs out")
    look.check(output, option="--output")
    check_range("runs", runs, 1)
    from tvist_lab.in_process import free_setup
    from tvist_lab.studies.paper.experiment import count, simulate
    from tvist_lab.studies.paper.published import ARMS
    from tvist_lab.studies.paper.report import as_dict

    names = ARMS if robot is calibration is None else (robot or ARMS[0],)
    setups = [free_setup(robot=name, calibration=calibration, seed=seed) for name in names]
    compile_if_new()
    wanted = [baselines, *(False for _ in names[1:])]
    with (
        failing_on(exit_code=2),
        progress(sum(count(runs, baselines=one) for one in wanted), "motions") as bar,
    ):
        arms = [
            simulate(setup, runs=runs, seed=seed, baselines=one, progress=lambda what: bar(1, what))
            for setup, one in zip(setups, wanted, strict=True)
        ]
    first, *others = map(as_dict, arms)
    if output is not None:
        from tvist_lab.studies.paper.figures import draw

        look.write(output, lambda: draw(arms[0], all_figures=True))
    result = {**first, "others": others}
    print_result(result, lambda: _print_paper(result), json=json)


def _in_real_time(
    folder: Path, seed: int, look: FigureOptions, *, tables: bool, view: bool, json: bool
) -> None:
    look.check(folder, option="--output")
    from tvist_lab.metrics import NotMeasurableError
    from tvist_lab.studies.paper.experiment import count
    from tvist_lab.studies.paper.served import serve

    compile_if_new()
    recording = folder / "demo.mcap"
    with (
        progress(count(1, baselines=False), "motions", f"the recording so far is in {folder}") as bar,
        failing_on(RuntimeError, NotMeasurableError),
    ):
        result = serve(recording, seed, lambda what: bar(1, what))
        overview = _figures(result, folder, look)
    if tables and not json:
        _print_paper(result.report)
    print_result(result.report, lambda: _say(result, overview, recording), json=json)
    if not result.equal:
        raise Failure("the recording differs from its replay or from what the client received")
    if view:
        from tvist_cli.tracks import recorded
        from tvist_view.playback import meet

        serve_page(recorded(recording).page(MAGNIFY), meet)


def _figures(result: "ServedExperiment", folder: Path, look: FigureOptions) -> Path:
    """Draw the paper's figures and the overview; return the path of the overview."""
    from tvist_lab.studies.paper.figures import draw, overview

    with look.into(folder) as save:
        for name, figure in draw(result.done, all_figures=False).items():
            save(figure, name)
        return save(overview(result.done, ANSWERED), "vibration-with-and-without-shaping")


def _say(result: "ServedExperiment", overview: Path, recording: Path) -> None:
    """Print the result of the experiment, and four commands to try next, each on one line for copying."""
    from tvist_lab.studies.paper.answer import answer, checks, terms

    for line in answer(result.report, ANSWERED):
        out.print(line)
    out.print(f"\n  look at {overview}", soft_wrap=True)
    out.print(f"  ({recording.parent} also holds the paper's figures and the recording)\n", soft_wrap=True)
    words({**terms(result.report, ANSWERED), **checks(result.report, result.difference)})
    name = program()
    commands = {
        f"{name} view {recording} --beside": "shows a motion without and with shaping on a web page, magnified",
        f"{name} demo --runs 1 --no-baselines": "prints the paper's tables beside ours",
        f"{name} serve": "starts a robot: leave it running, and in a second terminal",
        f"{name} move Q3 --shaper none": "moves it, unshaped; with --shaper zv, shaped",
    }
    width = max(map(len, commands))
    out.print("next:")
    for command, does in commands.items():
        out.print(f"  {command:{width}}  {does}", soft_wrap=True)


def _print_paper(result: dict[str, Any]) -> None:
    """Print the tables of each arm, and where each figure in them comes from."""
    from tvist_lab.studies.paper.report import MEANINGS, beside

    arms = [result, *result.get("others", ())]
    for one in arms:
        _print_arm(one)
    words({**TERMS, **METHOD_TERMS})
    headings, *rows = beside(arms)
    table("origin of each figure", headings, rows)
    words(MEANINGS)
    for note in dict.fromkeys(note for one in arms for note in one["notes"]):
        out.print(note)


def _print_arm(result: dict[str, Any]) -> None:
    from tvist_lab.studies.paper.published import published
    from tvist_lab.studies.paper.report import methods, table_2

    theirs, robot = published()["configurations"], result["robot"]
    of_both = ((name, theirs[name], row) for name, row in result["table_1"].items())
    table(
        f"{robot}: Table 1, lowest mode with 5 kg",
        ("pose", "f_d Hz, paper", "identified", "true", "ζ, paper", "identified", "true"),
        [
            (
                name, number(paper["f_d_hz"], 1), number(row["f_d_hz"], 2), number(row.get("true_f_d_hz"), 2),
                number(paper["zeta"], 2), number(row["zeta"], 3), number(row.get("true_zeta"), 3),
            )
            for name, paper, row in of_both
        ],
    )  # fmt: skip
    runs = "one run" if result["runs"] == 1 else f"mean of {result['runs']} runs"
    table(
        f"{robot}: Table 2, {runs} beside the paper's 10",
        ("motion", "delay ms", "stabil. ms", "cycle ms", "overshoot m", "RV m/s²"),
        [(f"{motion} {what}", *figures) for motion, what, *figures in table_2(result["table_2"], 3)],
    )
    for motion in result["baselines"]:
        table(
            f"{robot}, {motion}: every method from the start of the unshaped reference (← still first)",
            ("method", "delay ms", "RV m/s²", "peak m/s²", "less %", "still ms", "q̈/limit"),
            methods(result, motion, "{} ←"),
        )

"""`tvist demo`: the paper's motions over the network and in real time."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.output import out, print_json, program, progress, words
from tvist_cli.pages import Door
from tvist_cli.serving import compile_if_new
from tvist_cli.tables import print_paper
from tvist_cli.tracks import MAGNIFY, recorded

PORT = 8080
"""Port of the page of --view."""


def demo(
    *,
    output: Path = Path("tvist-demo"),
    seed: int = 0,
    tables: bool = False,
    view: bool = False,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Serve a robot, run the paper's motions on it over Zenoh in real time, unshaped and shaped, and say what happened.

    Args:
        output: Folder for the recording and the figures.
        seed: Seed of sensor noise and gear errors.
        tables: Print the paper's tables beside those of this run as well.
        view: Show the motions afterwards on a web page, with the arm's bending drawn 100 times larger.
        look: How to write the figures.
        json: Print one JSON object with all results.
    """
    files = look.into(output)
    from tvist_lab.demo import ANSWERED, DemoError, run_demo
    from tvist_lab.studies.paper.answer import answer, checks, terms
    from tvist_lab.studies.paper.experiment import count

    compile_if_new()
    with (
        progress(count(1, baselines=False), "motions", f"the recording so far is in {output}") as bar,
        told(DemoError, OSError),
    ):

        def advance(what: str) -> None:
            bar(1, what)

        result = run_demo(files, seed, advance)
    if json:
        print_json(result.report)
    else:
        if tables:
            print_paper(result.report)
        for line in answer(result.report, ANSWERED):
            out.print(line, markup=False)
        out.print(f"\n  look at {result.overview}", soft_wrap=True, markup=False)
        out.print(
            f"  ({output} also holds the paper's figures and the recording)\n", soft_wrap=True, markup=False
        )
        words({**terms(result.report, ANSWERED), **checks(result.report, result.difference)})
        _print_next(result.recording)
    if not result.equal:
        raise Failure("the recording differs from its replay or from what the client received")
    if view:
        recorded(result.recording).serve(MAGNIFY, Door("127.0.0.1", PORT, insecure=False))


def _print_next(recording: Path) -> None:
    """Print four commands that work as they stand; each is one line, however narrow the terminal, to be copied."""
    name = program()
    commands = {
        f"{name} view {recording} --beside": "shows a motion without and with shaping on a web page, magnified",
        f"{name} paper --runs 1 --no-baselines": "prints the paper's tables beside ours",
        f"{name} serve": "starts a robot: leave it running, and in a second terminal",
        f"{name} move Q3 --shaper none": "moves it, unshaped; with --shaper zv, shaped",
    }
    width = max(map(len, commands))
    out.print("next:")
    for command, does in commands.items():
        out.print(f"  {command:{width}}  {does}", soft_wrap=True, markup=False)

"""`tvist demo`: the paper's motions over the network and in real time."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json, progress
from tvist_cli.tables import print_paper


def demo(*, output: Path = Path("tvist-demo"), seed: int = 0, json: bool = False) -> None:
    """Serve a robot, run the paper's motions on it over Zenoh in real time, unshaped and shaped, and show the results.

    Args:
        output: Folder for the recording and the figures.
        seed: Seed of sensor noise and gear errors.
        json: Print one JSON object.
    """
    from tvist_lab.demo import DemoError, run_demo
    from tvist_lab.paper.experiment import count

    with (
        progress(count(1, baselines=False), "motions", f"the recording so far is in {output}") as bar,
        told(DemoError, OSError),
    ):

        def advance(what: str) -> None:
            bar(1, what)

        result = run_demo(output, seed, advance)
    if json:
        print_json(result.report)
    else:
        print_paper(result.report)
        out.print(result.verdict)
        for path in (result.recording, *result.figures):
            out.print(f"  {path}")
        out.print(
            "next: tvist serve, then tvist move Q2 in another terminal; or clients/examples/01_bare_client.py"
        )
    if not result.equal:
        raise Failure("the recording differs from its replay or from what the client received")

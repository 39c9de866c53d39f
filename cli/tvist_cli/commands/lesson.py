"""`tvist lesson`: one flexible joint and two impulses, on a page or in numbers."""

import asyncio
import os
import sys
import webbrowser
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import out, print_json, progress, table, typed
from tvist_cli.pages import Door, serve_page
from tvist_cli.serving import compile_if_new

if TYPE_CHECKING:
    from tvist_view.lesson import Compared

HERE = Door("127.0.0.1", 8080, insecure=False)
"""Where the page is served if nothing else is asked."""
MOVED = ("Q1", "Q2")
"""The motion of the UR5e: it ends stretched out, where it is slowest."""


def lesson(
    *,
    numbers: bool = False,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    markdown: Path | None = None,
    serve: bool = False,
    address: str = HERE.address,
    port: int = HERE.port,
    insecure: bool = HERE.insecure,
    json: bool = False,
) -> None:
    """Open a page on which to try shaping: a mass on a spring, an arm that folds, a shaper of your own, a UR5e.

    The page is one file that computes in the browser, without a server or a network; the command says where it is, to
    be copied. With --serve, a page is served instead whose simulated UR5e moves with the error that you choose.

    With --numbers, --figures, --markdown or --json there is no page: the robot one-joint is simulated, which takes
    about ten seconds. It is plucked at many angles of its elbow, to compare its frequency and damping with their
    formulas, and makes motions that end at three angles, unshaped and shaped.

    Args:
        numbers: Print the tables of the arm with one flexible joint.
        figures: Folder to write figure 2 to.
        look: How to write the figures.
        markdown: File to write a page with the formulas and the tables to.
        serve: Serve a page whose UR5e is simulated as you ask, until Control+C.
        address: With --serve: address on which the page is served.
        port: With --serve: port on which the page is served; 0 takes a free one.
        insecure: With --serve: serve the page to other machines.
        json: Print one JSON object.
    """
    look.check(figures, markdown)
    door = Door(address, port, insecure)
    if not serve and door != HERE:
        raise Failure("address, port and insecure are of a page that is served: give --serve, too", code=2)
    if not (numbers or json or figures is not None or markdown is not None):
        if not serve:
            _open_page()
            return
        from tvist_view.lesson import Lesson

        shown = Lesson(_moved)
        serve_page(shown.page, shown.meet, door)
        return
    from tvist_lab.one_joint import lesson as run
    from tvist_lab.one_joint.markdown import MODES, delays, left, modes, page

    compile_if_new()
    with progress(run.COUNT, "plucks and motions") as bar:
        done = run.lesson(lambda: bar(1, None))
    with told(OSError):
        if figures is not None:
            from tvist_lab.figures import figure_2

            write(look.into(figures), {"figure_02": figure_2(done)})
        if markdown is not None:
            markdown.write_text(page(done, typed()), encoding="utf-8")
    if json:
        print_json(done.as_dict())
        return
    table(f"the mode at three angles of the elbow, {done.description.payload.mass:g} kg", MODES, modes(done))
    out.print(
        f"over {len(run.ANGLES)} angles with two payloads, the simulated f_d is within {done.worst_f_d:.2f} % of the "
        f"formula, ζ within {done.worst_zeta:.1f} %"
    )
    ends = [row[0] for row in modes(done)]
    table(
        "largest acceleration after motions that end at q, and share of the unshaped one",
        ("", *ends),
        left(done),
    )
    table("how much longer the motions last", ("", *ends), delays(done))


def _open_page() -> None:
    """Say where the page is, and show it in the browser of a graphical session."""
    page = Path(str(files("tvist_view").joinpath("try.html")))
    out.print(f"the page is the file {page}: open it in any browser, or copy it to wherever it is wanted")
    graphical = sys.platform in {"darwin", "win32"} or bool(
        {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    )
    if graphical:  # elsewhere a browser in the terminal would open, which draws nothing
        webbrowser.open(page.as_uri())


async def _moved(error: float, zeta: float) -> "Compared":
    """The UR5e's motion, unshaped and with ZV for a frequency that is off by a share [-]."""
    return await asyncio.to_thread(_simulated, error, zeta)


def _simulated(error: float, zeta: float) -> "Compared":
    from tvist_lab.compared import run_beside
    from tvist_plant.description import load
    from tvist_view.lesson import Compared, largest_after_stop
    from tvist_view.look import Look
    from tvist_view.track import Shown, Track

    poses = load("ur5e").poses
    way = [poses[name] for name in MOVED]
    info, unshaped = asyncio.run(run_beside("none", way))
    f_d = (1.0 + error) * unshaped.truths[-1].f_d[0]
    _, shaped = asyncio.run(run_beside("zv", way, modes=(f_d, zeta)))
    assert info.geometry is not None  # of our own server
    first, second = (
        Track(Shown(label, Look(info.geometry, info.payload)), run.states, run.truths)
        for label, run in (("unshaped", unshaped), ("shaped", shaped))
    )
    return Compared(first, second, f_d=f_d, left=(largest_after_stop(first), largest_after_stop(second)))

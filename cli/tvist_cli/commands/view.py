"""`tvist view`: a page with a robot in three dimensions, its plots and its controls."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, told
from tvist_cli.offered import ROBOTS, SHAPERS
from tvist_cli.output import err
from tvist_cli.pages import Door, serve_page
from tvist_cli.tracks import MAGNIFY, Shows, compared, recorded, repeated
from tvist_client.robot import NAME

LONGEST_S = 120.0
"""Longest recording that is written as HTML [s]."""


def view(
    at: Connection = LOCAL,
    *,
    beside: bool = False,
    compare: Annotated[tuple[str, ...] | None, SHAPERS, Parameter(consume_multiple=True)] = None,
    robot: Annotated[str, ROBOTS] = "ur5e",
    magnify: float = MAGNIFY,
    html: Path | None = None,
    address: str = "127.0.0.1",
    port: int = 8080,
    insecure: bool = False,
) -> None:
    """Show a robot on a web page: the arm in three dimensions, its bending magnified, plots and controls.

    ENDPOINT is that of a served robot, which the page shows live, or the name of a recording, which it plays back.
    --compare needs neither: it simulates the same motion with two or three shapers and shows the arms beside each
    other. Without a name, a live page begins with the robot ur5e.

    Args:
        at: Where the robot is, or the MCAP file.
        beside: Of a recording, show the motion that it holds without and with a shaper, both at once.
        compare: Two or three shapers to simulate and to show beside each other: --compare none auto.
        robot: Name of the robot to simulate with --compare, or path of a robot file.
        magnify: Factor by which bending is drawn larger at first, 1 to 300.
        html: HTML file to write the comparison or the recording to, instead of showing a page; it needs no server.
        address: Address on which the page is served.
        port: Port on which the page is served; 0 takes a free one.
        insecure: Serve the page to other machines; anyone who opens it can move the robot.
    """
    if not 1.0 <= magnify <= 300.0:
        raise Failure(f"magnify is {magnify:g}: must be 1 to 300", code=2)
    door = Door(address, port, insecure)
    shows = _recorded_or_simulated(at.endpoint, compare, robot, both=beside)
    if shows is None:
        if html is not None:
            raise Failure("--html needs a recording or --compare", code=2)
        _live(at, magnify, door)
        return
    if html is None:
        shows.serve(magnify, door)
        return
    if shows.lasts > LONGEST_S:
        raise Failure(
            f"the recording lasts {shows.lasts:.0f} s: --html takes at most {LONGEST_S:.0f} s", code=2
        )
    from tvist_lab.whole_file import write_whole

    with told(OSError):
        write_whole(html, shows.page(magnify).encode())
    err.print(f"wrote {html}")


def _recorded_or_simulated(
    what: str, compare: tuple[str, ...] | None, robot: str, *, both: bool
) -> Shows | None:
    """Return what to play back; None if a served robot is shown live."""
    if compare is not None:
        return compared(compare, robot)
    if _is_file(what):
        return (repeated if both else recorded)(Path(what))
    if both:
        raise Failure("--beside needs a recording", code=2)
    return None


def _is_file(what: str) -> bool:
    return what.endswith(".mcap") or Path(what).exists()


def _live(at: Connection, factor: float, door: Door) -> None:
    from tvist_cli.judging import judge
    from tvist_view.live import LivePage
    from tvist_view.shown_robot import Place

    live = LivePage(Place(at.endpoint, at.security, at.namespace), at.name or NAME, judge, factor=factor)
    serve_page(live.page, live.meet, door, live.run, live.meshes.content)

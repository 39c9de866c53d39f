"""`tvist view`: show a robot in three dimensions on a web page, with plots and controls."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, failing_on
from tvist_cli.offered import ROBOTS, SHAPERS
from tvist_cli.output import err
from tvist_cli.pages import MAGNIFY, PageAddress, serve_page
from tvist_client.robot import NAME

if TYPE_CHECKING:
    from tvist_cli.tracks import Shows

LONGEST_S = 120.0  # longest recording that can be written as HTML [s]


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

    If ENDPOINT is that of a served robot, the page shows the robot live; if it is the name of a recording,
    the page plays it back. --compare needs neither: it simulates the same motion with two or three shapers
    and shows the arms side by side. Without a name, a live page starts with the robot ur5e.

    Args:
        at: Where the robot is, or the MCAP file.
        beside: Show the motion of a recording without and with a shaper at the same time.
        compare: Simulate two or three shapers and show them side by side: --compare none auto.
        robot: With --compare, simulate this robot: a name that comes with the package, or the path of a robot file.
        magnify: Draw bending larger by this factor at first, 1 to 300.
        html: Write the comparison or the recording to this HTML file, which needs no server, instead of
            showing a page.
        address: Serve the page on this address.
        port: Serve the page on this port; 0 takes a free one.
        insecure: Serve the page to other machines; anyone who opens it can move the robot.
    """
    if not 1.0 <= magnify <= 300.0:
        raise Failure(f"magnify is {magnify:g}: must be 1 to 300", code=2)
    door = PageAddress(address, port, insecure)
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

    with failing_on(OSError):
        write_whole(html, shows.page(magnify).encode())
    err.print(f"wrote {html}")


def _recorded_or_simulated(
    what: str, compare: tuple[str, ...] | None, robot: str, *, both: bool
) -> "Shows | None":
    """Return what to play back; None if a served robot is shown live."""
    if compare is not None or what.endswith(".mcap") or Path(what).exists():
        from tvist_cli.tracks import compared, recorded, repeated

        return (
            compared(compare, robot) if compare is not None else (repeated if both else recorded)(Path(what))
        )
    if both:
        raise Failure("--beside needs a recording", code=2)
    return None


def _live(at: Connection, factor: float, door: PageAddress) -> None:
    from tvist_cli.judging import judge
    from tvist_view.live import LivePage
    from tvist_view.shown_robot import RobotPlace

    live = LivePage(RobotPlace(at.endpoint, at.security, at.namespace), at.name or NAME, judge, factor=factor)
    serve_page(live.page, live.meet, door, live.run, live.meshes.content)

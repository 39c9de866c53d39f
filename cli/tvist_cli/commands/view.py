"""`tvist view`: show a robot in three dimensions on a web page, with plots and controls."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Misuse, check_range
from tvist_cli.offered import ROBOTS, SHAPERS
from tvist_cli.output import err
from tvist_cli.pages import MAGNIFY, serve_page
from tvist_client.robot import NAME

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
    check_range("magnify", magnify, 1.0, 300.0)
    if not (compare is not None or at.endpoint.endswith(".mcap") or Path(at.endpoint).exists()):
        if beside or html is not None:
            needs = "--beside needs a recording" if beside else "--html needs a recording or --compare"
            raise Misuse(f"{needs}: give one, or leave the option out")
        from tvist_cli.judging import judge
        from tvist_view.live import LivePage
        from tvist_view.shown_robot import RobotPlace

        place = RobotPlace(at.endpoint, at.security, at.namespace)
        live = LivePage(place, at.name or NAME, judge, factor=magnify)
        parts = live.meshes.content
        serve_page(live.page, live.meet, address, port, insecure=insecure, run=live.run, parts=parts)
        return
    from tvist_cli.tracks import compared, recorded, repeated
    from tvist_lab.whole_file import write_whole
    from tvist_view.playback import meet

    file = Path(at.endpoint)
    shows = compared(compare, robot) if compare is not None else repeated(file) if beside else recorded(file)
    if html is None:
        serve_page(shows.page(magnify), meet, address, port, insecure=insecure)
        return
    if shows.lasts > LONGEST_S:
        raise Misuse(f"the recording lasts {shows.lasts:.0f} s: --html takes at most {LONGEST_S:.0f} s")
    write_whole(html, shows.page(magnify).encode())
    err.print(f"wrote {html}")

"""`tvist view`: a page with a robot in three dimensions, its plots and its controls."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import err, progress
from tvist_cli.pages import serve_page
from tvist_cli.serving import compile_if_new
from tvist_cli.tracks import recorded, show_tracks

if TYPE_CHECKING:
    from tvist_view.track import Track

LONGEST_S = 120.0
"""Longest recording that is written as GIF or HTML [s]: a second takes about a megabyte."""
MAGNIFY_COMPARED = 100.0
"""Magnification where shapers are compared, unless another is given [-]."""


def view(
    what: str = "tcp/127.0.0.1:7447",
    *,
    name: str = "ur5e",
    security: Path | None = None,
    namespace: str = "",
    compare: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (),
    robot: str = "ur5e",
    magnify: float | None = None,
    gif: Path | None = None,
    html: Path | None = None,
    address: str = "127.0.0.1",
    port: int = 8080,
    insecure: bool = False,
) -> None:
    """Show a robot on a web page: the arm in three dimensions, its bending magnified, plots and controls.

    WHAT is the endpoint of a served robot, which the page shows live, or a recording, which it plays back. --compare
    needs neither: it simulates the same motions with two or three shapers and shows the arms beside each other.

    Args:
        what: Zenoh endpoint of a served robot, or MCAP file.
        name: Name of the served robot.
        namespace: Namespace of the robot, if it is served in one.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        compare: Two or three shapers to simulate and to show beside each other: --compare none auto.
        robot: Name of the robot to simulate with --compare, or path of a robot file.
        magnify: Factor by which bending is drawn larger at first, 1 to 300 [1; 100 with --compare].
        gif: GIF to write the comparison or the recording to, for slides, instead of showing a page.
        html: HTML file to write the comparison or the recording to, instead of showing a page; it needs no server.
        address: Address on which the page is served.
        port: Port on which the page is served; 0 takes a free one.
        insecure: Serve the page to other machines; anyone who opens it can move the robot.
    """
    if magnify is not None and not 1.0 <= magnify <= 300.0:
        raise Failure(f"magnify is {magnify:g}: must be 1 to 300", code=2)
    factor = magnify if magnify is not None else MAGNIFY_COMPARED if compare else 1.0
    tracks = _compared(compare, robot) if compare else recorded(Path(what)) if _is_file(what) else None
    if tracks is None:
        if gif is not None or html is not None:
            raise Failure("--gif and --html need a recording or --compare", code=2)
        _live(what, name, security, namespace, factor, (address, port), insecure=insecure)
        return
    lasts = max(track.end for track in tracks) - min(track.start for track in tracks)
    if (gif or html) and lasts > LONGEST_S:
        raise Failure(
            f"the recording lasts {lasts:.0f} s: --gif and --html take at most {LONGEST_S:.0f} s", code=2
        )
    if gif is not None:
        _write_gif(tracks, factor, gif)
    if html is not None:
        _write_html(tracks, factor, html)
    if gif is None and html is None:
        show_tracks(tracks, factor, (address, port), insecure=insecure)


def _is_file(what: str) -> bool:
    return what.endswith(".mcap") or Path(what).exists()


def _live(
    endpoint: str,
    name: str,
    security: Path | None,
    namespace: str,
    factor: float,
    place: tuple[str, int],
    *,
    insecure: bool,
) -> None:
    from tvist_view.live import show_robot

    serve_page(
        lambda server: show_robot(server, endpoint, name, security, namespace, factor=factor),
        place,
        f"tvist {name}",
        insecure=insecure,
    )


def _compared(shapers: Sequence[str], robot: str) -> "list[Track]":
    """The same motions with each shaper, simulated now."""
    from tvist_controller.commands.refusal import RefusalError
    from tvist_lab.compared import run_beside
    from tvist_plant.description import DescriptionError, load
    from tvist_server.config import ConfigError
    from tvist_view.cockpit import pairs
    from tvist_view.track import Shown, Track

    if not 2 <= len(shapers) <= 3:
        raise Failure(f"compare has {len(shapers)} shapers: give two or three", code=2)
    compile_if_new()
    tracks = []
    with told(DescriptionError, ConfigError, RefusalError, code=2), progress(len(shapers), "runs") as advance:
        poses = load(robot).poses
        named = pairs(list(poses))
        if not named:
            raise Failure(f"robot file {robot} names no two poses to move between", code=2)
        first, last = named[0]
        for shaper in shapers:
            way = (poses[first], poses[last], poses[first])
            info, collected = asyncio.run(run_beside(shaper, way, robot=robot))
            assert info.geometry is not None  # of our own server
            shown = Shown(shaper, info.geometry, info.payload)
            tracks.append(Track(shown, collected.states, collected.truths))
            advance(1, None)
    return tracks


def _write_gif(tracks: "list[Track]", factor: float, file: Path) -> None:
    from tvist_view.deflection import Magnification
    from tvist_view.film import Film

    film = Film(tracks, Magnification(factor))
    with told(OSError), progress(len(film.times()), "pictures") as advance:
        film.write(file, lambda: advance(1, None))
    err.print(f"wrote {file}")


def _write_html(tracks: "list[Track]", factor: float, file: Path) -> None:
    from tvist_view.playback import Playback
    from tvist_view.stage import StageError, close_stage, open_stage

    with told(StageError, OSError):
        server = open_stage("127.0.0.1", 0, "tvist")
        try:
            file.write_text(Playback(server, tracks, factor=factor).html(), encoding="utf-8")
        finally:
            close_stage(server)
    err.print(f"wrote {file}")

"""`tvist view`: a page with a robot in three dimensions, its plots and its controls."""

import asyncio
import logging
import os
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import err, progress

if TYPE_CHECKING:
    from viser import ViserServer

    from tvist_lab.mcap_file import RecordingFile
    from tvist_protocol.geometry import Geometry
    from tvist_protocol.values import Payload
    from tvist_view.track import Track

NICE = 5
"""How much a page gives way to other programs, such as a robot's server on the same machine."""
MAGNIFY_COMPARED = 100.0
"""Magnification where shapers are compared, unless another is given [-]."""


def view(
    what: str = "tcp/127.0.0.1:7447",
    *,
    name: str = "ur5e",
    security: Path | None = None,
    compare: tuple[str, ...] = (),
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
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        compare: Shaper to simulate and to show beside the others, repeatable: --compare none --compare auto.
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
    tracks = _compared(compare, robot) if compare else _recorded(Path(what)) if _is_file(what) else None
    if tracks is None:
        if gif is not None or html is not None:
            raise Failure("--gif and --html need a recording or --compare", code=2)
        _live(what, name, security, factor, (address, port), insecure=insecure)
        return
    if gif is not None:
        _write_gif(tracks, factor, gif)
    if html is not None:
        _write_html(tracks, factor, html)
    if gif is None and html is None:
        from tvist_view.playback import Playback

        _serve(
            lambda server: Playback(server, tracks, factor=factor).run(),
            (address, port),
            "tvist",
            insecure=insecure,
        )


def _is_file(what: str) -> bool:
    return what.endswith(".mcap") or Path(what).exists()


def _live(
    endpoint: str, name: str, security: Path | None, factor: float, place: tuple[str, int], *, insecure: bool
) -> None:
    from tvist_view.live import show_robot

    _serve(
        lambda server: show_robot(server, endpoint, name, security, factor=factor),
        place,
        f"tvist {name}",
        insecure=insecure,
    )


def _serve(
    run: "Callable[[ViserServer], Coroutine[Any, Any, None]]",
    place: tuple[str, int],
    title: str,
    *,
    insecure: bool,
) -> None:
    """Serve a page until Control+C."""
    from tvist_view.stage import StageError, close_stage, open_stage

    logging.basicConfig(format="tvist: %(message)s", level=logging.WARNING)
    if hasattr(os, "nice"):
        os.nice(NICE)
    with told(StageError):
        server = open_stage(*place, title, insecure=insecure)
    err.print(f"the page is at http://{place[0]}:{server.get_port()} (Control+C ends it)")
    try:
        with told():
            asyncio.run(run(server))
    except KeyboardInterrupt:
        raise interrupted("the page has ended") from None
    finally:
        close_stage(server)


def _recorded(file: Path) -> "list[Track]":
    """The run in a recording."""
    from tvist_lab.mcap_file import read
    from tvist_lab.recordings import RecordingError
    from tvist_view.track import Shown, Track, TrackError

    with told(RecordingError, TrackError, ValueError):
        content = read(file)
        geometry, payload = _look_of(content)
        return [Track(Shown(file.stem, geometry, payload), content.states, content.truths)]


def _compared(shapers: Sequence[str], robot: str) -> "list[Track]":
    """The same motions with each shaper, simulated now."""
    from tvist_controller.refusal import RefusalError
    from tvist_lab.compared import run_beside
    from tvist_plant.description import DescriptionError, load
    from tvist_server.config import ConfigError
    from tvist_view.cockpit import pairs
    from tvist_view.track import Shown, Track

    if not 2 <= len(shapers) <= 3:
        raise Failure(f"compare has {len(shapers)} shapers: give two or three", code=2)
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


def _look_of(content: "RecordingFile") -> "tuple[Geometry, Payload]":
    """What the robot of a recording looks like: as it says, or by its robot file, which a server's recording holds."""
    from tvist_controller.about import geometry_of
    from tvist_plant.description import RobotDescription
    from tvist_protocol.content import checked
    from tvist_protocol.values import Payload

    info, start = content.info, content.start or {}
    if info is not None and info.geometry is not None:
        return info.geometry, info.payload
    if "description" in start:
        geometry = geometry_of(checked(start["description"], RobotDescription))
        nothing = Payload(mass=0.0, com=(0.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        return geometry, nothing if info is None else info.payload
    raise Failure(
        "this recording does not say what its robot looks like: record it with tvist serve --record"
    )


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

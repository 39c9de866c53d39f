"""Recordings as runs that a page plays back."""

from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.pages import serve_page

if TYPE_CHECKING:
    from tvist_lab.recordings.mcap_file import RecordingFile
    from tvist_protocol.geometry import Geometry
    from tvist_protocol.values import Payload
    from tvist_view.track import Track


def show_tracks(tracks: "list[Track]", factor: float, place: tuple[str, int], *, insecure: bool) -> None:
    """Play runs back on a page until Control+C.

    Args:
        tracks: The runs.
        factor: Magnification of the bending to begin with.
        place: Address and port of the page.
        insecure: Serve other machines, too.
    """
    from tvist_view.playback import Playback

    serve_page(
        lambda server: Playback(server, tracks, factor=factor).run(), place, "tvist", insecure=insecure
    )


def recorded(file: Path) -> "list[Track]":
    """The run in a recording."""
    from tvist_lab.recordings import RecordingError
    from tvist_lab.recordings.mcap_file import read
    from tvist_view.chain import Chain
    from tvist_view.track import Shown, Track, TrackError

    with told(RecordingError, TrackError, ValueError):
        content = read(file)
        geometry, payload = _look_of(content)
        Chain(geometry)  # raises where this program cannot draw it
        return [Track(Shown(file.stem, geometry, payload), content.states, content.truths)]


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

"""The page of recorded runs: one robot, or several beside each other at the same tick."""

from collections.abc import Sequence

from viser import ViserServer

from tvist_view.appearance import Appearance
from tvist_view.drawn_arm import CAP, Colour
from tvist_view.pictures import FRAME_S, PLOT_EVERY, pictures
from tvist_view.plots import Plots
from tvist_view.scene import DrawnRobot
from tvist_view.stage import look_at
from tvist_view.track import Track

APART = 0.9
"""Distance between two bases [m]."""
COLOURS: tuple[Colour, ...] = ((213, 94, 0), (0, 114, 178), (0, 158, 115))
"""Of robots beside each other: those of the plots."""
NO_TRUTH = (
    "This recording has no truth, so the arm is drawn stiff. Record with "
    "`tvist serve --truth --record FILE` to see it bend."
)


class Playback:
    """Runs on a page, with a scrub bar.

    Args:
        server: Server of the page.
        tracks: The runs; their times are those of one clock.
        factor: Magnification to begin with.
        ghost: Whether to show the unshaped reference.
    """

    def __init__(
        self, server: ViserServer, tracks: Sequence[Track], *, factor: float = 1.0, ghost: bool = True
    ) -> None:
        self._server, self._tracks = server, tracks
        self.start = min(track.start for track in tracks)
        self.end = max(track.end for track in tracks)
        several = len(tracks) > 1
        middle = (len(tracks) - 1) / 2.0
        gui = server.gui
        length = max(self.end - self.start, 0.001)
        self._time = gui.add_slider("Time s", 0.0, round(length, 3), 0.002, 0.0, order=1.0)
        self._time.on_update(lambda event: self._scrubbed() if event.client is not None else None)
        self._play = gui.add_checkbox("play", initial_value=True, order=2.0)
        self._pace = gui.add_dropdown(
            "Speed", ("1", "0.5", "0.25", "0.1", "0.05"), order=3.0,
            hint="In slow motion an eye can follow the vibration.",
        )  # fmt: skip
        with gui.add_folder(None, order=10.0):
            self._plots = Plots(gui, tuple(track.shown.label for track in tracks) if several else ("",))
            with gui.add_folder("View", order=40.0):
                self._appearance = Appearance(
                    gui,
                    truth=all(track.has_truth for track in tracks),
                    why_not=NO_TRUTH,
                    factor=factor,
                    ghost=ghost,
                )
        self._drawn = [
            DrawnRobot(
                server.scene,
                f"/robot_{number}",
                track.shown.geometry,
                track.shown.payload,
                at=(0.0, APART * (middle - number), 0.0),
                colour=COLOURS[number % len(COLOURS)] if several else CAP,
                label=track.shown.label if several else "",
            )
            for number, track in enumerate(tracks)
        ]
        look_at(server, (0.0, 0.0, 0.45), 1.9 + 0.6 * APART * (len(tracks) - 1))
        self._frame = 0

    def show(self, time: float) -> None:
        """Draw the robots at a time since the start [s]."""
        now = self.start + time
        self._draw(now)
        if self._frame % PLOT_EVERY == 0:
            self._plots.show(tuple(track.signals for track in self._tracks), now)
        self._frame += 1

    def _draw(self, now: float) -> None:
        with self._server.atomic():
            for drawn, track in zip(self._drawn, self._tracks, strict=True):
                drawn.show(track.at(now), self._appearance)

    async def run(self) -> None:
        """Play until cancelled, over and over."""
        time: float | None = None  # that of the last picture
        async for _ in pictures():
            if time is not None and self._play.value and float(self._time.value) == time:
                time += FRAME_S * float(self._pace.value)
                self._time.value = 0.0 if time > self.end - self.start else round(time, 3)  # type: ignore[misc]
            time = float(self._time.value)
            self.show(time)

    def html(self) -> str:
        """The whole run as one page that needs no server: the arms with their ghosts, without plots."""
        serializer = self._server.get_scene_serializer()
        time = 0.0
        self._scrubbed()
        while time <= self.end - self.start:
            self._draw(self.start + time)
            serializer.insert_sleep(FRAME_S)
            time += FRAME_S
        return serializer.as_html()

    def _scrubbed(self) -> None:
        for drawn in self._drawn:
            drawn.forget_trace()

"""A film for slides: recorded runs beside each other, and how their tools shake below."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from tvist_view.chain import Chain, Floats
from tvist_view.deflection import Magnification
from tvist_view.track import Track

RATE = 25
"""Pictures a second."""
DPI = 80
PANEL = 3.6
"""Width and height of one robot's picture [inch]."""
PLOT = 1.7
"""Height of the plot below [inch]."""
COLOURS = ("#D55E00", "#0072B2", "#009E73")
BODY, EDGE, GHOST, INK = "#D6DBE0", "#5B6670", "#B8B8B8", "#333333"
MARGIN = 0.15
"""Room around the arms [m]."""
AZIMUTH, ELEVATION = np.radians(-58.0), np.radians(18.0)
TRACE_S = 1.5
"""Time that the tool's trace goes back [s]."""
SETTLED_S = 0.02
"""Time after a stop within which the tool still brakes [s]."""
SLOW, SLOW_S = 5, 0.4
"""After a stop everything is this much slower, for this long [s]: the arm rings for a few tenths of a second."""
REST_S = 1.0
"""Time after a stop that is looked at, unless the next motion begins before [s]."""


class Film:
    """Pictures of runs.

    Args:
        tracks: The runs; their times are those of one clock.
        magnification: How deflections are drawn.
    """

    def __init__(self, tracks: Sequence[Track], magnification: Magnification) -> None:
        self._tracks, self._magnification = tracks, magnification
        self._chains = [Chain(track.shown.geometry) for track in tracks]
        self.start = min(track.start for track in tracks)
        self.end = max(track.end for track in tracks)
        right = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
        towards = np.array(
            [np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)]
        )
        self._view = np.stack([right, np.cross(towards, right), towards])
        self._stops = [_stops(track) for track in tracks]
        self._middle, self._reach = self._seen()
        after = [
            track.signals.between(at + SETTLED_S, at + REST_S).largest_alpha()
            for track, stops in zip(tracks, self._stops, strict=True)
            for at in stops
        ]
        largest = max(track.signals.largest_alpha() for track in tracks)
        self._highest = 1.3 * max(*after, 0.1) if after else max(largest, 0.1)

    def picture(self, time: float) -> Image.Image:
        """The picture at a simulation time [s]."""
        count = len(self._tracks)
        figure = Figure(figsize=(PANEL * count, PANEL + PLOT), dpi=DPI)
        canvas = FigureCanvasAgg(figure)
        share = PLOT / (PANEL + PLOT)
        for number, (track, chain) in enumerate(zip(self._tracks, self._chains, strict=True)):
            axes = figure.add_axes((number / count, share, 1.0 / count, 1.0 - share))
            self._robot(axes, track, chain, time, COLOURS[number % len(COLOURS)])
        margin = 0.6 / (PANEL * count)
        self._plot(figure.add_axes((margin, 0.3 * share, 1.0 - 1.25 * margin, 0.52 * share)), time)
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        return Image.fromarray(pixels).convert("RGB")

    def write(self, file: Path, progress: Callable[[], None] = lambda: None) -> None:
        """Write all pictures as an animated GIF.

        Args:
            file: GIF to write.
            progress: Called after each picture.
        """
        pictures = []
        for time in self.times():
            picture = self.picture(time)
            pictures.append(picture.quantize(colors=64, dither=Image.Dither.NONE))
            progress()
        pictures[0].save(
            file,
            save_all=True,
            append_images=pictures[1:],
            duration=round(1000 / RATE),
            loop=0,
            optimize=True,
        )

    def times(self) -> list[float]:
        """Simulation times of the pictures: in slow motion after each stop [s]."""
        found = [self.start]
        while found[-1] < self.end:
            found.append(found[-1] + 1.0 / (RATE * (SLOW if self._slow(found[-1]) else 1)))
        return found[:-1] or found

    def _slow(self, time: float) -> bool:
        return any(at - SETTLED_S <= time < at + SLOW_S for at in self._stops[0])

    def _seen(self) -> tuple[tuple[float, float], float]:
        """Middle of what is seen, and half its width [m]: all arms have room in it all the time."""
        points = [
            (self._view @ frame[:3, 3])[:2]
            for track, chain in zip(self._tracks, self._chains, strict=True)
            for time in np.arange(track.start, track.end + 0.1, 0.1)
            for frame in chain.frames(np.array(track.at(time).state.reference_q))
        ]
        low, high = np.nanmin(points, axis=0) - MARGIN, np.nanmax(points, axis=0) + MARGIN
        middle = (low + high) / 2.0
        return (float(middle[0]), float(middle[1])), float((high - low).max()) / 2.0

    def _robot(self, axes: Axes, track: Track, chain: Chain, time: float, colour: str) -> None:
        (x, y), reach = self._middle, self._reach
        axes.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), aspect="equal")
        axes.axis("off")
        axes.text(0.5, 0.97, track.shown.label, transform=axes.transAxes, ha="center", va="top", size=13,
                  color=colour, weight="bold")  # fmt: skip
        words = [f"bending × {self._magnification.factor:g}"] if self._magnification.factor != 1.0 else []
        words += [f"slow motion, 1/{SLOW}"] if self._slow(time) else []
        if words:
            axes.text(0.5, 0.9, ", ".join(words), transform=axes.transAxes, ha="center", va="top", size=9,
                      color=INK)  # fmt: skip
        points_per_m = 72.0 * PANEL / (2.0 * reach)
        self._floor(axes)
        moment = track.at(time)
        ghost = chain.frames(np.array(moment.state.reference_q))
        self._capsules(axes, chain, ghost, points_per_m, GHOST, GHOST, alpha=0.35)
        trace = [
            self._flange(track, chain, t) for t in np.arange(max(time - TRACE_S, track.start), time, 0.02)
        ]
        if len(trace) > 1:
            x, y = (self._view @ np.array(trace).T)[:2]
            axes.plot(x, y, color=colour, linewidth=1.2, zorder=50)
        self._capsules(axes, chain, self._frames(track, chain, time), points_per_m, BODY, EDGE)

    def _frames(self, track: Track, chain: Chain, time: float) -> Floats:
        moment = track.at(time)
        if moment.truth is None:
            return chain.frames(np.array(moment.state.actual_q))
        return chain.frames(*self._magnification.drawn(moment.truth))

    def _flange(self, track: Track, chain: Chain, time: float) -> Floats:
        return np.asarray(self._frames(track, chain, time)[-1][:3, 3])

    def _capsules(
        self,
        axes: Axes,
        chain: Chain,
        frames: Floats,
        scale: float,
        fill: str,
        edge: str,
        *,
        alpha: float = 1.0,
    ) -> None:
        """Capsules as lines with round ends, which is what they look like from afar; the nearest last."""
        for part in chain.parts:
            ends = np.array([frames[part.frame] @ [*end, 1.0] for end in (part.start, part.end)])[:, :3]
            x, y, depth = self._view @ ends.T
            width = 2.0 * part.radius * scale
            order = 10.0 + float(depth.mean())
            for colour, share, above in ((edge, 1.0, 0.0), (fill, 0.86, 0.001), ("white", 0.25, 0.002)):
                if colour == "white" and alpha < 1.0:
                    continue
                lift = 0.22 * part.radius if colour == "white" else 0.0
                axes.add_line(
                    Line2D(x - lift, y + lift, color=colour, linewidth=share * width, solid_capstyle="round",
                           zorder=(order + above) if alpha == 1.0 else 5.0, alpha=alpha if colour != "white" else 0.7)
                )  # fmt: skip

    def _floor(self, axes: Axes) -> None:
        for at in np.arange(-1.0, 1.01, 0.25):
            for ends in (([at, -1.0, 0.0], [at, 1.0, 0.0]), ([-1.0, at, 0.0], [1.0, at, 0.0])):
                x, y = (self._view @ np.array(ends).T)[:2]
                axes.plot(x, y, color="#E6E6E6", linewidth=0.8, zorder=0)

    def _plot(self, axes: Axes, time: float) -> None:
        for number, track in enumerate(self._tracks):
            signals = track.signals
            shown = signals.time <= time
            axes.plot(
                signals.time[shown] - self.start, signals.alpha[shown], color=COLOURS[number % len(COLOURS)],
                linewidth=1.3, label=track.shown.label,
            )  # fmt: skip
        for at in self._stops[0]:
            axes.axvspan(at - self.start, at + REST_S - self.start, color="#F0F0F0", zorder=0)
        axes.set(xlim=(0.0, self.end - self.start), ylim=(0.0, self._highest))
        axes.set_title(
            "acceleration of the tool |α| [m/s²] over time [s]; grey: it should stand still",
            size=9,
            color=INK,
            loc="left",
        )
        axes.tick_params(labelsize=8, colors=INK)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)


def _stops(track: Track) -> list[float]:
    """Times at which the reference before the shaper came to rest [s]."""
    signals = track.signals
    moves = signals.unshaped > 1e-3
    ends = np.flatnonzero(moves[:-1] & ~moves[1:])
    calm = round(0.5 * REST_S / 0.002)  # a cruise at constant velocity accelerates as little, but is no stop
    return [float(signals.time[end]) for end in ends if not moves[end + 1 : end + calm].any()]

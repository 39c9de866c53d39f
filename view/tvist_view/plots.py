"""The plots of the page: how the tool shakes, what the joints are asked to do, what the shaper believes."""

import numpy as np
from viser import GuiApi, GuiHtmlHandle, GuiUplotHandle, uplot

from tvist_view.chain import Floats
from tvist_view.signals import Signals, rests_since

SPAN = 3.0
"""Time shown [s]."""
POINTS = 500
"""Points of a curve at most."""
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#8A8A8A"
HEIGHT = 150
"""Height of a plot [px]."""
BRAKES_S = 0.02
"""Time after the shaped reference has stopped within which the tool still brakes [s]."""
SMALL = 0.1
"""Least upper end of an axis, so that noise does not fill a plot [m/s², rad/s², Hz]."""


class Plots:
    """Four plots over the last three seconds: |α|, q̈, f_d and ζ.

    Args:
        gui: Where they are added.
        labels: Name of each robot, in the order of the signals; one robot needs none.
    """

    def __init__(self, gui: GuiApi, labels: tuple[str, ...] = ("",)) -> None:
        colours = (BLUE,) if len(labels) == 1 else (ORANGE, BLUE, GREEN)
        named = [
            (f"{label} " if label else "", colour) for label, colour in zip(labels, colours, strict=False)
        ]
        self._alpha = _plot(gui, "Tool acceleration |α| [m/s²]", [(f"{n}|α|", c, True) for n, c in named])
        self._peak = gui.add_html("")
        self._delay = gui.add_html("")
        self._labels, self._colours = labels, colours
        with gui.add_folder("More plots", order=50.0):
            self._add_more(gui, named)

    def _add_more(self, gui: GuiApi, named: list[tuple[str, str]]) -> None:
        lines = [(f"{n}q̈ shaped", c, False) for n, c in named]
        grey = ", grey: before the shaper, green: its delay" if len(named) == 1 else ""
        if len(named) == 1:
            lines = [("q̈ before the shaper", GREY, False), *lines, ("delay of the stop", GREEN, True)]
        self._acceleration = _plot(gui, f"Largest joint acceleration |q̈| [rad/s²]{grey}", lines)
        self._f_d = _plot(gui, "Estimated frequency f_d [Hz]", [(f"{n}f_d", c, False) for n, c in named])
        self._zeta = _plot(gui, "Estimated damping ratio ζ [-]", [(f"{n}ζ", c, False) for n, c in named])

    def show(self, robots: tuple[Signals, ...], now: float) -> None:
        """Draw the last seconds before a time.

        Args:
            robots: Signals of each robot.
            now: Simulation time at the right end [s].
        """
        grid = np.linspace(now - SPAN, now, POINTS)
        shown = [signals.between(now - SPAN, now) for signals in robots]
        seconds = grid - now
        alphas = [_peaks(signals.time, signals.alpha, grid) for signals in shown]
        least = np.zeros(POINTS)
        least[0] = SMALL
        self._alpha.data = (seconds, *alphas, least)
        qdd = [_peaks(signals.time, signals.acceleration, grid) for signals in shown]
        if len(shown) == 1:
            qdd.insert(0, _peaks(shown[0].time, shown[0].unshaped, grid))
            qdd.append(_delayed(shown[0], grid, max(float(qdd[0].max()), SMALL)))
        self._acceleration.data = (seconds, *qdd, least)
        self._f_d.data = (seconds, *(_held(signals.time, signals.f_d, grid) for signals in shown), least)
        self._zeta.data = (seconds, *(_held(signals.time, signals.zeta, grid) for signals in shown), least)
        self._say(shown)

    def _say(self, shown: list[Signals]) -> None:
        peaks, delays = [], []
        for label, colour, signals in zip(self._labels, self._colours, shown, strict=False):
            if not len(signals.time):
                continue
            name = f'<b style="color:{colour}">{label}</b>: ' if label else ""
            peak = f"{name}largest {signals.largest_alpha():.2f} m/s²"
            words = f"{name}mean delay of the shaper {1e3 * signals.delay[-1]:.0f} ms"
            rests = rests_since(signals)
            if rests is not None:
                rest = signals.between(rests[1] + BRAKES_S, signals.time[-1])
                peak += f", {rest.largest_alpha():.2f} m/s² after the stop"
                words += f"; came to rest {1e3 * (rests[1] - rests[0]):.0f} ms after its reference"
            peaks.append(peak)
            delays.append(words)
        _write(self._peak, peaks)
        _write(self._delay, delays)


def _write(html: GuiHtmlHandle, lines: list[str]) -> None:
    content = "".join(f'<div style="font-size:0.8em;padding:0 0.8em">{line}</div>' for line in lines)
    if html.content != content:
        html.content = content


def _plot(gui: GuiApi, title: str, lines: list[tuple[str, str, bool]]) -> GuiUplotHandle:
    empty = np.linspace(-SPAN, 0.0, 2)
    return gui.add_uplot(
        (empty, *(np.zeros(2) for _ in lines), np.array([SMALL, 0.0])),
        (
            uplot.Series(label="s"),
            *(
                uplot.Series(label=label, stroke=colour, width=1.5, fill=f"{colour}22" if filled else "")
                for label, colour, filled in lines
            ),
            uplot.Series(label="", stroke="transparent", points=uplot.Series_Points(show=False)),
        ),
        title=title,
        scales={"x": uplot.Scale(time=False, auto=False, range=(-SPAN, 0.0)), "y": uplot.Scale(auto=True)},
        height=HEIGHT,
        legend=uplot.Legend(show=False),
    )


def _delayed(signals: Signals, grid: Floats, height: float) -> Floats:
    """A block from the stop of the reference to that of the shaped reference."""
    rests = rests_since(signals)
    if rests is None:
        return np.zeros(len(grid))
    return np.where((grid >= rests[0]) & (grid <= rests[1]), height, 0.0)


def _peaks(time: Floats, values: Floats, grid: Floats) -> Floats:
    """Largest value in each step of a grid, so that no peak is lost between its points."""
    out = np.zeros(len(grid))
    if len(time):
        np.maximum.at(out, np.clip(np.searchsorted(grid, time), 0, len(grid) - 1), np.nan_to_num(values))
        step = np.diff(time, prepend=time[0] - 1.0)
        if (
            np.median(step) > grid[1] - grid[0]
        ):  # fewer samples than points: what is between them is drawn between
            out = np.interp(grid, time, np.nan_to_num(values))
    return out


def _held(time: Floats, values: Floats, grid: Floats) -> Floats:
    """Values at a grid's points."""
    if not len(time):
        return np.zeros(len(grid))
    return np.asarray(np.interp(grid, time, np.nan_to_num(values)))

"""Figures of the residual vibration of shapers for a wrong frequency, and of their cost in time."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import tvist_shaping
from tvist_lab.figures.style import (
    FAINT,
    OF_SHAPED,
    OF_UNSHAPED,
    SERIES,
    dashed,
    legend,
    name_over,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.frequency_error import ALLOWED, residual_over_error, settling_time
from tvist_lab.recordings import Floats
from tvist_shaping import Shaper, residual

DESIGN, SPAN = 10.5, (6.0, 15.0)
"""Design frequency of the shapers of figure 4, and range of the UR5e's first mode with 5 kg [Hz]."""
SHOWN_HZ = (5.5, 16.0)  # range of the frequency axis in figure 4 [Hz]
ERRORS = (0.0, 0.1, 0.2)  # frequency errors for which settling is drawn [-]
FAMILIES = {
    "Zero vibration": ("zv", "mzv", "zvd", "zvdd", "zvddd"),
    "Extra-insensitive": ("ei", "ei_exact", "si", "ei2", "ei2_exact", "ei3", "ei3_exact"),
    "Negative impulses: short, but beyond the reference's limits": ("um_zv", "um_zvd"),
}  # panels and their shapers; all others share a last panel
SHOWN_SHARE = (0.4, 1.7)  # range of the axis: true divided by assumed frequency [-]
HIGHEST = 25.0  # largest residual vibration on the axis [%]
WIDEST = 1.6  # largest band width on the axis; unlimited bands are drawn here [-]


def figure_4() -> Figure:
    """Draw the residual vibration of ZV, ZVD and EI, undamped, over the true frequency."""
    figure, (panel,) = panels(1, 3.4)
    f, ends = np.linspace(*SHOWN_HZ, 1051), np.array(SPAN)
    worst = np.inf
    panel.axvspan(*SPAN, color=tint(FAINT, 0.15), linewidth=0.0, label="First mode over the workspace")
    shapers = {"ZV": tvist_shaping.zv, "ZVD": tvist_shaping.zvd, "EI 5 %": tvist_shaping.ei}
    for (name, function), style in zip(shapers.items(), SERIES, strict=False):
        impulses = function(DESIGN, 0.0)
        panel.plot(f, 100.0 * residual(f, 0.0, impulses), **style.line(1.6, label=name))
        worst = min(worst, 100.0 * float(np.max(residual(ends, 0.0, impulses))))
    dashed(panel, worst)
    note(panel, f"{worst:.1f} %", (DESIGN, worst), (0, 4), ha="center")
    title(panel, f"{SPAN[0]:g} to {SPAN[1]:g} Hz: at least {worst:.1f} % remains")
    panel.set(xlim=SHOWN_HZ, ylim=(0.0, 72.0), xlabel="Frequency (Hz)", ylabel="Residual vibration (%)")
    legend(figure, panel)
    return figure


def sensitivity_figure(shapers: Sequence[Shaper], zeta: float, errors: Floats) -> Figure:
    """Draw the residual vibration of shapers over the share by which the assumed frequency is too high."""
    figure, (panel,) = panels(1, 3.6)
    dashed(panel, 100.0 * ALLOWED, label=f"{100.0 * ALLOWED:g} %")
    for place, shaper in enumerate(shapers):
        left = 100.0 * residual_over_error(shaper, zeta, errors)
        panel.plot(100.0 * errors, left, **SERIES[place % len(SERIES)].line(label=shaper.name))
    panel.set(xlim=(100.0 * errors[0], 100.0 * errors[-1]), xlabel="Error of the assumed frequency (%)")
    panel.set(ylim=(0.0, None), ylabel="Residual vibration (%)")
    title(panel, f"Mode with a damping ratio of {zeta:g}")
    legend(figure, panel)
    return figure


def settling_against_delay_figure(shapers: Iterable[Shaper], f_d: float, zeta: float) -> Figure:
    """Draw the settling time of a mode with each shaper against its delay, for frequency errors."""
    # Shapers that do not support this damping are left out.
    shown = [shaper for shaper in shapers if zeta < shaper.zeta_max]
    delay = np.array([1e3 * shaper.impulses(f_d, zeta).duration for shaper in shown])
    times = np.array([[1e3 * settling_time(one, f_d, zeta, error) for one in shown] for error in ERRORS])
    top = 1.15 * float(np.max(times, where=np.isfinite(times), initial=1.0 / 1.15))
    figure, (panel,) = panels(1, 4.2)
    straight: Any = {"color": FAINT, "linewidth": 0.9, "label": "Settled when the reference stops"}
    panel.plot([0.0, top], [0.0, top], zorder=1, **straight)
    drawn = np.where(np.isfinite(times), times, top)
    for error, row, style in zip(ERRORS, drawn, SERIES, strict=False):
        panel.plot(delay, row, **style.points(4.5, label=f"Frequency wrong by {100.0 * error:g} %"))
    if not np.isfinite(times).all():
        title(panel, "At the top: never, since nothing decays without damping")
    name_over(panel, delay, drawn.max(axis=0), [one.name for one in shown])
    longest = float(delay.max())
    panel.set(ylim=(0.0, 1.75 * top), xlim=(-0.04 * longest, 1.06 * longest))
    panel.set(xlabel="Delay of the shaper (ms)", ylabel="Settled after the unshaped stop (ms)")
    mode = f"a mode of {f_d:g} Hz, ζ = {zeta:g}"
    legend(figure, panel, {"Settled": f"at {100.0 * ALLOWED:g} % of the unshaped vibration of {mode}"})
    return figure


def catalogue_figure(shapers: Iterable[Shaper], zeta: float = 0.0) -> Figure:
    """Draw each shaper's residual vibration over the true frequency, and its band width against its duration."""
    # Shapers that do not support this damping, or do not shape, are left out.
    shown = {shaper.name: shaper for shaper in shapers if zeta < shaper.zeta_max and shaper.duration_periods}
    placed = {name for names in FAMILIES.values() for name in names}
    families = FAMILIES | {"Others": tuple(name for name in shown if name not in placed)}
    found = {words: [shown[name] for name in names if name in shown] for words, names in families.items()}
    groups = {words: group for words, group in found.items() if group}
    figure, axes = panels(len(groups) + 1, 1.0 + 2.1 * (len(groups) + 1), share_x=False)
    f = np.linspace(*SHOWN_SHARE, 1301)
    for panel, (words, group) in zip(axes, groups.items(), strict=False):
        title(panel, words)
        for place, shaper in enumerate(group):
            left = 100.0 * residual(f, zeta, shaper.function(1.0, zeta))
            panel.plot(f, left, **SERIES[place % len(SERIES)].line(label=shaper.name))
        dashed(panel, 100.0 * ALLOWED)
        panel.set(xlim=SHOWN_SHARE, ylim=(0.0, HIGHEST), ylabel="Residual vibration (%)")
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes[len(groups) - 1].set_xlabel("True over assumed frequency (–)")
    title(axes[-1], "What insensitivity costs")
    _price(axes[-1], list(shown.values()), zeta)
    legend(figure, axes[-1])
    return figure


def _price(panel: Axes, shapers: Sequence[Shaper], zeta: float) -> None:
    """Draw the width of each shaper's 5 % band against its duration; shapers at one place share a point."""
    points: dict[tuple[float, float], list[Shaper]] = {}
    for shaper in shapers:
        low, high = shaper.band(ALLOWED * (1.0 + 1e-4), zeta)  # count a hump of exactly 5 % as inside
        place = round(shaper.function(1.0, zeta).duration, 2), round(min(high - low, WIDEST), 2)
        points.setdefault(place, []).append(shaper)
    for place, group in sorted(points.items()):
        exceeds = group[0].peak > 1.0
        panel.plot(*place, **(OF_UNSHAPED if exceeds else OF_SHAPED).points(4.5))
        words = ", ".join(shaper.name for shaper in group)
        # Put names where there is room: above shapers that exceed limits, below long ones, else beside.
        offset, ha, va = (6, 4 if words.endswith("_exact") and len(group) == 1 else 0), "left", "center"
        if exceeds:
            offset, ha, va = (4, 4), "right", "bottom"
        elif place[0] > 1.7:
            offset, ha, va = (4, -4), "right", "top"
        note(panel, words, place, offset, ha=ha, va=va)
    panel.set(xlim=(0.0, 2.1), xlabel="Duration (damped periods)", ylabel="Width of the 5 % band (–)")
    panel.margins(y=0.12)
    panel.plot([], [], **OF_SHAPED.points(4.5, label="Keeps the reference's limits"))
    panel.plot([], [], **OF_UNSHAPED.points(4.5, label="Exceeds them"))

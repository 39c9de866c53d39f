"""The catalogue of shapers: residual vibration at a wrong frequency, and its cost in time."""

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.style import INK, LIMIT, OF_SHAPED, OF_UNSHAPED, SERIES, legend, note, panels, title
from tvist_shaping import Shaper, residual

FAMILIES = {
    "Zero vibration": ("zv", "mzv", "zvd", "zvdd", "zvddd"),
    "Extra-insensitive": ("ei", "ei_exact", "si", "ei2", "ei2_exact", "ei3", "ei3_exact"),
    "Negative impulses: short, but beyond the reference's limits": ("um_zv", "um_zvd"),
}
"""Panels and their shapers; those in none of them share a panel at the end."""
SHOWN = (0.4, 1.7)
"""Range of the axis: true divided by assumed frequency [-]."""
HIGHEST = 25.0
"""Largest residual vibration on the axis [%]."""
ALLOWED = 0.05
"""Residual vibration at which the width of a band is measured [-]."""
WIDEST = 1.6
"""Largest width that is drawn; unlimited bands are drawn here [-]."""


def catalogue_figure(shapers: Iterable[Shaper], zeta: float = 0.0) -> Figure:
    """Residual vibration of each shaper against the true frequency, and the width of its band against its duration.

    Args:
        shapers: The shapers; those that do not support this damping, or do not shape, are left out.
        zeta: Damping ratio, assumed and true [-].
    """
    shown = {shaper.name: shaper for shaper in shapers if zeta < shaper.zeta_max and shaper.duration_periods}
    placed = {name for names in FAMILIES.values() for name in names}
    families = FAMILIES | {"Others": tuple(name for name in shown if name not in placed)}
    groups = {
        words: group
        for words, names in families.items()
        if (group := [shown[name] for name in names if name in shown])
    }
    figure, axes = panels(len(groups) + 1, 1.0 + 2.1 * (len(groups) + 1), share_x=False)
    for panel, (words, group) in zip(axes, groups.items(), strict=False):
        title(panel, words)
        _curves(panel, group, zeta)
    axes[len(groups) - 1].set_xlabel("True over assumed frequency (–)")
    title(axes[-1], "What insensitivity costs")
    _price(axes[-1], list(shown.values()), zeta)
    legend(figure, axes[-1])
    return figure


def _curves(panel: Axes, shapers: Sequence[Shaper], zeta: float) -> None:
    f = np.linspace(*SHOWN, 1301)
    for place, shaper in enumerate(shapers):
        left = 100.0 * residual(f, zeta, shaper.function(1.0, zeta))
        panel.plot(f, left, **SERIES[place % len(SERIES)].line(label=shaper.name))
    panel.axhline(100.0 * ALLOWED, color=INK, linewidth=0.8, linestyle=LIMIT)
    panel.set(xlim=SHOWN, ylim=(0.0, HIGHEST), ylabel="Residual vibration (%)")
    panel.legend(
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize=8,
        frameon=False,
        labelcolor=INK,
        handlelength=3.0,
    )


def _price(panel: Axes, shapers: Sequence[Shaper], zeta: float) -> None:
    points: dict[tuple[float, float], list[Shaper]] = {}
    for shaper in shapers:
        low, high = shaper.band(ALLOWED * (1.0 + 1e-4), zeta)  # count a hump of exactly 5 % as inside
        width = min(high - low, WIDEST)
        duration = shaper.function(1.0, zeta).duration
        points.setdefault((round(duration, 2), round(width, 2)), []).append(shaper)
    for place, group in sorted(points.items()):
        style = OF_SHAPED if group[0].peak == 1.0 else OF_UNSHAPED
        panel.plot(*place, **style.points(4.5))
        words = ", ".join(shaper.name for shaper in group)
        above, below = group[0].peak > 1.0, place[0] > 1.7
        raised = 4 if words.endswith("_exact") and len(group) == 1 else 0
        note(
            panel,
            words,
            place,
            xytext=(4, 4) if above else (4, -4) if below else (6, raised),
            textcoords="offset points",
            ha="right" if above or below else "left",
            va="bottom" if above else "top" if below else "center",
        )
    panel.set(xlim=(0.0, 2.1), xlabel="Duration (damped periods)", ylabel="Width of the 5 % band (–)")
    panel.margins(y=0.12)
    panel.plot([], [], **OF_SHAPED.points(4.5, label="Keeps the reference's limits"))
    panel.plot([], [], **OF_UNSHAPED.points(4.5, label="Exceeds them"))

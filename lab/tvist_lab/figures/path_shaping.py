"""Figures of paths shaped along their parameter and joint by joint."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.evaluation.path_examples import BLEND, CORNER_SHAPER, CORNER_SPEED, Corner
from tvist_lab.evaluation.path_shaping import ALONG, JOINTS, WAYS
from tvist_lab.evaluation.paths import JudgedPath
from tvist_lab.figures.style import FAINT, SHAPED, UNSHAPED, legend, note, panels, title
from tvist_plant.plant import PERIOD

SHOWN = {ALONG: SHAPED, JOINTS: UNSHAPED}
"""Ways that the figures compare, and their colours."""
FLOOR = 0.01
"""Smaller shares of the vibration are drawn at this value [%]."""
BEYOND = 0.15
"""Width of the view of a corner beyond the blend on each side, relative to it [-]."""


def corner_figure(corner: Corner) -> Figure:
    """Draw a corner from above, with the shaped references in both ways, and their distances from the path."""
    figure, (above, below) = panels(2, 7.6, share_x=False, ratios=(7, 2))
    path = 1e3 * corner.path
    above.plot(path[:, 0], path[:, 1], color=FAINT, linewidth=3.0, alpha=0.6, label="Path")
    for way, color in SHOWN.items():
        x, y = 1e3 * corner.shaped[way].T
        above.plot(x, y, ".-", color=color, markersize=3.5, linewidth=0.9, label=f"Shaped {WAYS[way]}")
        off = 1e3 * corner.off[way]
        below.plot(PERIOD * np.arange(len(off)), off, color=color, linewidth=1.2)
    around = 1e3 * BLEND * np.array([-BEYOND, 1.0 + BEYOND])
    above.set(
        xlim=-around[::-1], ylim=around, xlabel="x from the corner (mm)", ylabel="y from the corner (mm)"
    )
    above.set_aspect("equal")
    below.set(xlabel="Time (s)", ylabel="Distance (mm)")
    title(
        above,
        f"{1e3 * BLEND:g} mm blend at {CORNER_SPEED:g} m/s, {CORNER_SHAPER}; a point every 2 ms",
    )
    title(below, "Distance from the path")
    legend(figure, above)
    return figure


def path_shaping_figure(judged: Sequence[JudgedPath]) -> Figure:
    """Draw the residual vibration and the vibration during the motion as boxes, by shaper and way."""
    figure, (above, below) = panels(2, 6.0)
    counted = [one for one in judged if one.counts]
    names = list(judged[0].shaped)
    for place, (way, color) in enumerate(SHOWN.items()):
        at = np.arange(len(names)) + (-0.18, 0.18)[place]
        left = [
            [max(100.0 - one.reduction(one.shaped[name][way]), FLOOR) for one in counted] for name in names
        ]
        moving = [
            [one.shaped[name][way].in_motion / one.unshaped.in_motion for one in judged] for name in names
        ]
        for panel, values in ((above, left), (below, moving)):
            _boxes(panel, values, at, color)
        above.plot([], [], color=color, linewidth=5.0, alpha=0.5, label=f"Shaped {WAYS[way]}")
    above.set_yscale("log")
    for axis in (above.yaxis.set_major_formatter, above.yaxis.set_minor_formatter):
        axis(lambda value, _: f"{value:g}" if str(value).strip("0.")[:1] in "125" else "")
    above.axhline(5.0, color=FAINT, linewidth=0.8, linestyle=":")
    for panel in (above, below):
        panel.set_xlim(-0.5, len(names) - 0.5)
    note(above, "5 %", (len(names) - 0.52, 5.0), color=FAINT, ha="right", va="bottom")
    above.set_ylabel("Peak after the stop (% of unshaped)")
    below.set_ylabel("rms during the motion / unshaped")
    below.axhline(1.0, color=FAINT, linewidth=0.8)
    below.set_xticks(np.arange(len(names)), names)
    title(above, f"Vibration after the stop, {len(counted)} paths")
    title(below, f"Vibration during the motion, {len(judged)} paths")
    legend(figure, above)
    return figure


def _boxes(panel: Axes, values: list[list[float]], at: np.ndarray, color: str) -> None:
    """Boxes from the lower to the upper quartile with whiskers to the 5th and 95th percentiles."""
    panel.boxplot(
        values,
        positions=at,
        widths=0.3,
        whis=(5, 95),
        showfliers=False,
        manage_ticks=False,
        patch_artist=True,
        boxprops={"facecolor": color, "alpha": 0.5, "edgecolor": color},
        medianprops={"color": "black", "linewidth": 1.2},
        whiskerprops={"color": color},
        capprops={"color": color},
    )

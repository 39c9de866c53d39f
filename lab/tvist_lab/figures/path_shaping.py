"""Figures of paths shaped along their parameter and joint by joint."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.evaluation.evaluate import WORTH
from tvist_lab.evaluation.path_examples import BLEND, CORNER_SHAPER, CORNER_SPEED, Corner
from tvist_lab.evaluation.path_shaping import ALONG, JOINTS, WAYS
from tvist_lab.figures.style import FAINT, SHAPED, UNSHAPED, legend, panels, title
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


def path_shaping_figure(paths: Sequence[dict[str, Any]]) -> Figure:
    """Draw boxes of the vibration after the stop and during the motion, and of the distance from the path.

    Args:
        paths: The paths of a report, see `tvist_lab.evaluation.path_report.report`.
    """
    figure, panes = panels(3, 8.4)
    counted = [one for one in paths if one["unshaped_peak_m_s2"] >= WORTH]
    names = list(paths[0]["shaped"])
    for (way, color), aside in zip(SHOWN.items(), (-0.18, 0.18), strict=True):
        at = np.arange(len(names)) + aside
        for panel, rows, key in zip(
            panes, (counted, paths, paths), ("reduction_percent", "in_motion_ratio", "off_mm"), strict=True
        ):
            values = [[one["shaped"][name][way][key] for one in rows] for name in names]
            if key == "reduction_percent":
                values = [[max(100.0 - reduction, FLOOR) for reduction in column] for column in values]
            _boxes(panel, values, at, color)
        panes[0].plot([], [], color=color, linewidth=5.0, alpha=0.5, label=f"Shaped {WAYS[way]}")
    above, middle, below = panes
    above.set_yscale("log")
    for axis in (above.yaxis.set_major_formatter, above.yaxis.set_minor_formatter):
        axis(lambda value, _: f"{value:g}" if str(value).strip("0.")[:1] in "125" else "")
    above.tick_params(which="both", labelsize=8)
    above.axhline(5.0, color=FAINT, linewidth=0.8, linestyle=":")
    above.set_ylabel("Peak (% of unshaped)")
    middle.axhline(1.0, color=FAINT, linewidth=0.8)
    middle.set_ylabel("rms / unshaped")
    below.set_ylabel("Largest distance (mm)")
    below.set_xticks(np.arange(len(names)), names)
    below.set_xlim(-0.5, len(names) - 0.5)
    title(above, f"Vibration after the stop, {len(counted)} paths")
    title(middle, f"Vibration during the motion, {len(paths)} paths")
    title(below, f"Distance of the shaped reference from the path, {len(paths)} paths")
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

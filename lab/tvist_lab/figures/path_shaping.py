"""Figures of paths shaped along their parameter and joint by joint."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tvist_lab.figures.style import (
    FAINT,
    OF_SHAPED,
    OF_UNSHAPED,
    Series,
    dashed,
    decades,
    legend,
    panels,
    tint,
    title,
)
from tvist_lab.studies.path_examples import BLEND, CORNER_SHAPER, CORNER_SPEED, Corner
from tvist_lab.studies.path_shaping import ALONG, JOINTS, WAYS
from tvist_lab.study.measures import WORTH
from tvist_plant.plant import PERIOD

SHOWN = {ALONG: OF_SHAPED, JOINTS: OF_UNSHAPED}
"""Ways that the figures compare, and their styles."""
FLOOR = 0.01
"""Smaller shares of the vibration are drawn at this value [%]."""
BEYOND = 0.15
"""Width of the view of a corner beyond the blend on each side, relative to it [-]."""


def corner_figure(corner: Corner) -> Figure:
    """Draw a corner from above, with the shaped references in both ways, and their distances from the path."""
    figure, (above, below) = panels(2, 7.6, share_x=False, ratios=(7, 2))
    path = 1e3 * corner.path
    above.plot(path[:, 0], path[:, 1], color=tint(FAINT, 0.5), linewidth=3.0, label="Path")
    for way, style in SHOWN.items():
        x, y = 1e3 * corner.shaped[way].T
        dots = style.line(0.9, marker=style.marker, markersize=2.0)
        above.plot(x, y, **dots, label=f"Shaped {WAYS[way]}")
        off = 1e3 * corner.off[way]
        below.plot(PERIOD * np.arange(len(off)), off, **style.line(1.2))
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
        paths: The paths of a report, see `tvist_lab.studies.paths.report`.
    """
    figure, panes = panels(3, 8.4)
    counted = [one for one in paths if one["unshaped_peak_m_s2"] >= WORTH]
    names = list(paths[0]["shaped"])
    for (way, style), aside in zip(SHOWN.items(), (-0.18, 0.18), strict=True):
        at = np.arange(len(names)) + aside
        for panel, rows, key in zip(
            panes, (counted, paths, paths), ("reduction_percent", "in_motion_ratio", "off_mm"), strict=True
        ):
            values = [[one["shaped"][name][way][key] for one in rows] for name in names]
            if key == "reduction_percent":
                values = [[max(100.0 - reduction, FLOOR) for reduction in column] for column in values]
            _boxes(panel, values, at, style)
        panes[0].bar(
            [0.0], [np.nan], facecolor=tint(style.color, 0.4), edgecolor=style.color, hatch=_hatch(style),
            label=f"Shaped {WAYS[way]}",
        )  # fmt: skip
    above, middle, below = panes
    above.set_yscale("log")
    decades(above, "y")
    dashed(above, 5.0, color=FAINT)
    above.set_ylabel("Peak over unshaped (%)")
    middle.axhline(1.0, color=FAINT, linewidth=0.8)
    middle.set_ylabel("RMS over unshaped (–)")
    below.set_ylabel("Largest distance (mm)")
    below.set_xticks(np.arange(len(names)), names)
    below.set_xlim(-0.5, len(names) - 0.5)
    title(above, f"Vibration after the stop, {len(counted)} paths")
    title(middle, f"Vibration during the motion, {len(paths)} paths")
    title(below, f"Distance of the shaped reference from the path, {len(paths)} paths")
    legend(figure, above)
    return figure


def _boxes(panel: Axes, values: list[list[float]], at: np.ndarray, style: Series) -> None:
    """Boxes from the lower to the upper quartile with whiskers to the 5th and 95th percentiles."""
    panel.boxplot(
        values,
        positions=at,
        widths=0.3,
        whis=(5, 95),
        showfliers=False,
        manage_ticks=False,
        patch_artist=True,
        boxprops={"facecolor": tint(style.color, 0.4), "edgecolor": style.color, "hatch": _hatch(style)},
        medianprops={"color": "black", "linewidth": 1.2},
        whiskerprops={"color": style.color},
        capprops={"color": style.color},
    )


def _hatch(style: Series) -> str:
    """Hatching that tells the boxes of two ways apart without colours."""
    return "" if style is OF_SHAPED else "////"

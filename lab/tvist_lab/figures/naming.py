"""Names over points, so that they do not cover each other."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tvist_lab.figures.style import note
from tvist_lab.recordings import Floats

NEAR = 0.035
"""Points that are closer than this share of the axis share a name [-]."""


def name_over(panel: Axes, x: Floats, highest: Floats, names: Sequence[str]) -> None:
    """Write names upwards from the highest point at each place; names of places that are close share a line.

    Args:
        panel: The panel.
        x: Places, shape (N,).
        highest: Highest point at each place, shape (N,).
        names: N names.
    """
    near = NEAR * float(np.ptp(x))
    groups: list[list[int]] = []
    for place in map(int, np.argsort(x, kind="stable")):
        if groups and x[place] - x[groups[-1][0]] <= near:
            groups[-1].append(place)
        else:
            groups.append([place])
    for group in groups:
        note(
            panel,
            ", ".join(names[place] for place in group),
            (float(x[group].mean()), float(highest[group].max())),
            xytext=(0, 6),
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="bottom",
            bbox=None,
        )

"""ShaperBench's figure: time until the arm is still against the residual vibration after the shaped stop."""

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.figures.style import FAINT, SHAPED, THIRD, note, panels, title


def pareto_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw each ranked shaper as a point, with medians over arms, moves and payload errors, and the front as a line.

    Args:
        rows: Rows of the leaderboard.
    """
    figure, (panel,) = panels(1, 4.6)
    ranked = [row for row in rows if row["ranked"]]
    placed: list[tuple[float, float, bool]] = []
    for place, row in enumerate(sorted(ranked, key=_point)):
        y, x = _point(row)
        marker, color = "o" if row["keeps_limits"] else "^", SHAPED if row["pareto"] else FAINT
        panel.semilogy(x, y, marker, color=color, markersize=5)
        right = _beside(place, (x, y), [_point(other)[::-1] for other in ranked])
        raised = any(
            abs(x - near) < 2.0 and abs(math.log(y / level)) < 0.1 and side == right
            for near, level, side in placed
        )
        placed.append((x, y, right))
        where: dict[str, Any] = {
            "xytext": (6 if right else -6, 9 if raised else 0),
            "ha": "left" if right else "right",
        }
        note(panel, row["name"], (x, y), textcoords="offset points", va="center", **where)
    front = sorted(
        (row["time_until_still_ms"]["median"], row["residual_m_s2"]["median"])
        for row in ranked
        if row["pareto"]
    )
    panel.semilogy(*zip(*front, strict=True), color=THIRD, linewidth=1.0, zorder=0)
    panel.set(xlabel="Still after the unshaped reference's stop (ms)", ylabel="Residual, 3 to 60 Hz (m/s²)")
    panel.margins(x=0.3)
    title(panel, "Settling against residual; ▲ exceeds a limit of the motion")
    return figure


def _point(row: dict[str, Any]) -> tuple[float, float]:
    """Residual vibration [m/s²] and time until still [ms]."""
    return row["residual_m_s2"]["median"], row["time_until_still_ms"]["median"]


def _beside(place: int, point: tuple[float, float], points: Sequence[tuple[float, float]]) -> bool:
    """Return whether to put a name on the right: away from a neighbour of similar height, else alternately."""
    x, y = point
    level = [other for other, height in points if abs(math.log(y / height)) < 0.12]
    if any(0.0 < other - x < 45.0 for other in level):
        return False
    if any(0.0 < x - other < 45.0 for other in level):
        return True
    return place % 2 == 1

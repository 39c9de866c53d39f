"""ShaperBench's figure: how soon the arm is still against what rings after the shaped stop."""

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.figures.style import FAINT, SHAPED, THIRD, note, panels, title


def pareto_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Each ranked shaper as a point, medians over arms, moves and payload errors; the front as a line.

    Args:
        rows: Of the leaderboard.
    """
    figure, (panel,) = panels(1, 4.6)
    ranked = [row for row in rows if row["ranked"]]
    for place, row in enumerate(sorted(ranked, key=lambda row: row["residual_m_s2"]["median"])):
        x, y = row["time_until_still_ms"]["median"], row["residual_m_s2"]["median"]
        marker, color = "o" if row["keeps_limits"] else "^", SHAPED if row["pareto"] else FAINT
        panel.semilogy(x, y, marker, color=color, markersize=5)
        where: dict[str, Any] = (
            {"xytext": (6, 1), "ha": "left"} if place % 2 else {"xytext": (-6, -1), "ha": "right"}
        )
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

"""Figure of a tick's time by box."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from tvist_lab.figures.style import FAINT, INK, SERIES, legend, panels, tint

GROUPS: Mapping[str, tuple[str, ...]] = {
    "Plant": ("plant",),
    "Drives' feed-forward": ("inverse dynamics", "drive feed-forward"),
    "Filter": ("TVIST filter",),
    "Reference and differentiator": ("trajectory generator", "unshaped reference", "differentiator"),
    "Look-ahead": ("look-ahead",),
    "Rest of the controller": ("controller",),
    "Report and encoding": ("reporting", "encoding"),
}
"""Bars, from left to right, with the boxes that each consists of; parts count for the innermost of these boxes."""
OTHERS = "Around the controller"


def tick_figure(ticks: Mapping[str, Mapping[str, float]], within: Mapping[str, str | None]) -> Figure:
    """Draw the time of a tick as one bar for each robot, made of groups of boxes.

    Args:
        ticks: Name of the robot to the time of each box itself [µs per tick].
        within: Box to the one that it is a part of.
    """
    figure, (panel,) = panels(1, 1.2 + 0.42 * len(ticks))
    names = list(ticks)
    ends = [0.0] * len(names)
    colors = [*(series.color for series in SERIES[:-1]), FAINT]
    for group, color in zip((*GROUPS, OTHERS), colors, strict=True):
        widths = [
            sum(us for box, us in ticks[name].items() if group_of(box, within) == group) for name in names
        ]
        panel.barh(
            names, widths, left=ends, height=0.62, color=tint(color, 0.75), edgecolor="white", label=group
        )
        ends = [end + width for end, width in zip(ends, widths, strict=True)]
    for row, end in enumerate(ends):
        panel.text(
            end,
            row,
            f" {end:.0f}",
            va="center",
            fontsize=8,
            color=INK,
        )
    panel.invert_yaxis()
    panel.grid(visible=False, axis="y")
    panel.set_xlabel("Time of a tick (µs)")
    panel.margins(x=0.08)
    legend(figure, panel)
    return figure


def group_of(box: str, within: Mapping[str, str | None]) -> str:
    """Return the group that a box belongs to, by itself or as a part."""
    present: str | None = box
    while present is not None:
        for group, boxes in GROUPS.items():
            if present in boxes:
                return group
        present = within[present]
    return OTHERS

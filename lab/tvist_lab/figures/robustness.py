"""Reduction of vibration by shapers in the order of their delays, for each error of stiffness and payload."""

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.evaluation.robustness import ERRORS
from tvist_lab.figures.style import SHAPED, THIRD, UNSHAPED, panels, title

COLORS = (SHAPED, THIRD, "#E69F00", UNSHAPED, "#CC79A7")
"""Colours of the errors, the smallest first."""


def robustness_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the median (full line) and the 5th percentile (broken) of the reduction, each the worse of ± an error.

    Args:
        rows: Rows of `robustness_report`, ordered by delay.
    """
    figure, axes = panels(2, 7.2)
    places = range(len(rows))
    for panel, (kind, errors) in zip(axes, ERRORS.items(), strict=True):
        for size, color in zip(sorted({abs(error) for error in errors}), COLORS, strict=False):
            names = [f"{100.0 * error:+.0f} %" for error in errors if abs(error) == size]
            for name, style, label in (("median", "o-", f"±{100.0 * size:.0f} %"), ("p5", "s:", None)):
                worse = [
                    min(_known(row[kind][error]["reduction_percent"][name]) for error in names)
                    for row in rows
                ]
                panel.plot(places, worse, style, color=color, label=label, markersize=3, linewidth=1.0)
        panel.set(ylabel="Reduction (%)")
        panel.legend(fontsize=7, frameon=False, ncols=2, loc="lower right")
        title(panel, f"Wrong {kind}: median (full) and 5th percentile (broken), the worse of ±")
    axes[-1].set_xticks(
        places, [f"{row['name']}, {row['delay_ms']:.0f} ms" for row in rows], rotation=90, fontsize=7
    )
    axes[-1].set(xlabel="Shapers in the order of their delay")
    return figure


def _known(value: float | None) -> float:
    return float("nan") if value is None else value

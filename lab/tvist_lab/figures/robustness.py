"""Reduction of vibration by shapers in the order of their delays, for each error of stiffness and payload."""

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from tvist_lab.figures.style import SERIES, panels, title
from tvist_lab.studies.robustness import ERRORS


def robustness_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the median (thick) and the 5th percentile (thin) of the reduction, each the worse of ± an error.

    Args:
        rows: Rows of `robustness_report`, ordered by delay.
    """
    figure, axes = panels(2, 7.2)
    places = range(len(rows))
    for panel, (kind, errors) in zip(axes, ERRORS.items(), strict=True):
        for size, style in zip(sorted({abs(error) for error in errors}), SERIES, strict=False):
            names = [f"{100.0 * error:+.0f} %" for error in errors if abs(error) == size]
            for name, width, label in (("median", 1.4, f"±{100.0 * size:.0f} %"), ("p5", 0.6, None)):
                worse = [
                    min(_known(row[kind][error]["reduction_percent"][name]) for error in names)
                    for row in rows
                ]
                panel.plot(
                    places,
                    worse,
                    **style.line(width, marker=style.marker, markersize=2.0 + width),
                    label=label,
                )
        panel.set(ylabel="Reduction (%)")
        panel.legend(
            fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=3.0
        )
        title(panel, f"Wrong {kind}: median (thick) and 5th percentile (thin), the worse of ±")
    axes[-1].set_xticks(
        places, [f"{row['name']}, {row['delay_ms']:.0f} ms" for row in rows], rotation=90, fontsize=8
    )
    axes[-1].set(xlabel="Shapers in the order of their delay")
    return figure


def _known(value: float | None) -> float:
    return float("nan") if value is None else value

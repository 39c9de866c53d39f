"""Figure 4: why one fixed shaper cannot serve the whole workspace."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

import tvist_shaping
from tvist_lab.figures.style import FAINT, INK, LIMIT, SERIES, legend, note, panels, tint, title

DESIGN = 10.5
"""Middle of the frequency range over the workspace [Hz]."""
SPAN = (6.0, 15.0)
"""Range of the first mode's damped frequency over the UR5e's workspace with 5 kg [Hz]."""
SHOWN = (5.5, 16.0)
"""Frequencies on the axis [Hz]."""


def figure_4(
    design: float = DESIGN,
    span: tuple[float, float] = SPAN,
    shapers: Mapping[str, tvist_shaping.Impulses] | None = None,
) -> Figure:
    """Residual vibration of ZV, ZVD and EI, undamped, over the true frequency.

    Args:
        design: Frequency that the shapers are designed for [Hz].
        span: Frequencies of the mode over the workspace [Hz].
        shapers: Name to impulses; None for the paper's three.
    """
    if shapers is None:
        shapers = {
            "ZV": tvist_shaping.zv(design, 0.0),
            "ZVD": tvist_shaping.zvd(design, 0.0),
            "EI 5 %": tvist_shaping.ei(design, 0.0),
        }
    figure, (panel,) = panels(1, 3.4)
    f = np.linspace(*SHOWN, 1051)
    worst = np.inf
    panel.axvspan(*span, color=tint(FAINT, 0.15), linewidth=0.0, label="First mode over the workspace")
    for index, (name, impulses) in enumerate(shapers.items()):
        residual = 100.0 * tvist_shaping.residual(f, 0.0, impulses)
        panel.plot(f, residual, **SERIES[index % len(SERIES)].line(1.6, label=name))
        worst = min(worst, 100.0 * float(np.max(tvist_shaping.residual(np.array(span), 0.0, impulses))))
    panel.axhline(worst, color=INK, linewidth=0.8, linestyle=LIMIT)
    # Every curve is near zero in the middle, where the shapers are designed.
    note(panel, f"{worst:.1f} %", (design, worst), xytext=(0, 4), textcoords="offset points", ha="center")
    title(panel, f"{span[0]:g} to {span[1]:g} Hz: at least {worst:.1f} % remains")
    panel.set(xlim=SHOWN, ylim=(0.0, 72.0), xlabel="Frequency (Hz)", ylabel="Residual vibration (%)")
    legend(figure, panel)
    return figure

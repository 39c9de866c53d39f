"""What a wrong frequency leaves of the vibration, and what it costs in time."""

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.figure import Figure

from tvist_lab.figures.naming import name_over
from tvist_lab.figures.style import FAINT, INK, LIMIT, SERIES, explain, legend, panels, title
from tvist_lab.frequency_error import ALLOWED, residual_over_error, settling_time
from tvist_lab.recordings import Floats
from tvist_shaping import Shaper

ERRORS = (0.0, 0.1, 0.2)
"""Errors of the frequency for which settling is drawn [-]."""


def sensitivity_figure(shapers: Sequence[Shaper], zeta: float, errors: Floats) -> Figure:
    """Draw the residual vibration of shapers over the error of the frequency.

    Args:
        shapers: The shapers.
        zeta: Damping ratio, both assumed and true [-].
        errors: Shares by which the assumed frequency is too high [-], shape (E,).
    """
    figure, (panel,) = panels(1, 3.6)
    panel.axhline(100.0 * ALLOWED, color=INK, linewidth=0.8, linestyle=LIMIT, label=f"{100.0 * ALLOWED:g} %")
    for place, shaper in enumerate(shapers):
        left = 100.0 * residual_over_error(shaper, zeta, errors)
        panel.plot(100.0 * errors, left, **SERIES[place % len(SERIES)].line(label=shaper.name))
    panel.set(
        xlim=(100.0 * errors[0], 100.0 * errors[-1]),
        xlabel="Error of the assumed frequency (%)",
        ylabel="Residual vibration (%)",
    )
    panel.set_ylim(bottom=0.0)
    title(panel, f"Mode with a damping ratio of {zeta:g}")
    legend(figure, panel)
    return figure


def settling_against_delay_figure(shapers: Iterable[Shaper], f_d: float, zeta: float) -> Figure:
    """Draw how soon a mode settles with each shaper against the shaper's delay, for errors of the frequency.

    Args:
        shapers: The shapers; those that do not support this damping are left out.
        f_d: True damped frequency [Hz].
        zeta: Damping ratio, both assumed and true [-].
    """
    shown = [shaper for shaper in shapers if zeta < shaper.zeta_max]
    delay = np.array([1e3 * shaper.impulses(f_d, zeta).duration for shaper in shown])
    times = np.array([[1e3 * settling_time(one, f_d, zeta, error) for one in shown] for error in ERRORS])
    known = times[np.isfinite(times)]
    top = 1.15 * float(known.max()) if known.size else 1.0
    figure, (panel,) = panels(1, 4.2)
    panel.plot(
        [0.0, top], [0.0, top], color=FAINT, linewidth=0.9, zorder=1, label="Settled when the reference stops"
    )
    for error, row, style in zip(ERRORS, times, SERIES, strict=False):
        ends = np.where(np.isfinite(row), row, top)
        panel.plot(delay, ends, **style.points(4.5, label=f"Frequency wrong by {100.0 * error:g} %"))
    if not np.isfinite(times).all():
        title(panel, "At the top: never, since nothing decays without damping")
    name_over(panel, delay, np.where(np.isfinite(times), times, top).max(axis=0), [one.name for one in shown])
    panel.set(
        xlabel="Delay of the shaper (ms)",
        ylabel="Settled after the unshaped stop (ms)",
        ylim=(0.0, 1.75 * top),
        xlim=(-0.04 * float(delay.max()), 1.06 * float(delay.max())),
    )
    legend(figure, panel)
    explain(
        figure,
        {
            "Settled": f"at {100.0 * ALLOWED:g} % of the unshaped vibration of a mode of {f_d:g} Hz, ζ = {zeta:g}"
        },
    )
    return figure

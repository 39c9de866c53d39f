"""Figure 8: one tick of the filter: buffered samples, interpolation between them, and the impulses of the moment."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import tvist_shaping
from tvist_lab.figures.style import (
    FAINT,
    INK,
    MUTED,
    OF_SHAPED,
    OF_THIRD,
    OF_UNSHAPED,
    dotted,
    legend,
    note,
    panels,
    tint,
    title,
)

PERIOD = 0.002
"""Tick [s]."""
F_D, ZETA = 14.35, 0.14
"""The mode as it is estimated at this tick: damped frequency [Hz] and damping ratio [-]; τ is between two ticks."""
BUFFERED = 22
"""Number of samples in the buffer."""
STEPS = ("Buffer", "Interpolate", "Convolve", "Shaped $x^*_i$")
"""Parts of the filter, from its input to its output."""


def figure_8() -> Figure:
    """Draw how the filter makes one sample.

    Top: its parts. Middle: the samples in the buffer, the reference interpolated between them, and the two delayed
    values that the impulses of this tick pick. Bottom: the impulses.
    """
    impulses = tvist_shaping.zv(F_D, ZETA)
    line = tvist_shaping.DelayLine(1, BUFFERED + 4)
    line.fill([0.0])
    for tick in range(BUFFERED + 4):
        line.push([_reference(tick - BUFFERED - 3)])
    figure, (parts, samples, weights) = panels(3, 5.6, share_x=False, ratios=(0.55, 1.3, 0.75))
    _draw_parts(parts)
    ago = np.arange(BUFFERED)
    samples.plot(
        -ago, [_at(line, float(k)) for k in ago], **OF_UNSHAPED.points(4.5, label="Buffered samples")
    )
    between = np.linspace(0.0, BUFFERED - 1, 421)
    samples.plot(
        -between,
        [_at(line, k) for k in between],
        **OF_THIRD.line(1.2, label="Interpolated reference, estimate of $x(t)$"),
    )
    delays = impulses.tau / PERIOD
    picked = [_at(line, delay) for delay in delays]
    shaped = float(impulses.A @ picked)
    samples.plot(
        -delays,
        picked,
        **OF_SHAPED.points(7.0, markerfacecolor="white", label="Picked by the impulses", zorder=4),
    )
    samples.plot([0.0], [shaped], "D", color=INK, markersize=6.0, label="Shaped reference $x^*_i$", zorder=5)
    samples.set(ylabel="Reference (mrad)", xlim=(-BUFFERED + 0.5, 1.5))
    samples.tick_params(labelbottom=False)
    for number, (A, delay) in enumerate(zip(impulses.A, delays, strict=True), 1):
        weights.plot([-delay] * 2, [0.0, A], color=OF_SHAPED.color, linewidth=2.0)
        weights.plot([-delay], [A], **OF_SHAPED.points(5.0))
        note(
            weights,
            f"$A_{number}$ = {A:.2f} at {delay:.2f} ticks",
            (-delay, A),
            (-6, 3) if number == 1 else (6, 3),
            ha="right" if number == 1 else "left",
        )
        dotted(samples, -delay, width=0.8)
    weights.set(
        ylabel="Amplitude (–)",
        xlabel="Time from this tick (ticks of 2 ms)",
        xlim=(-BUFFERED + 0.5, 1.5),
        ylim=(0.0, 0.9),
    )
    title(weights, r"$I_i$: impulses of this tick, from $f_d$ and $\zeta$")
    legend(
        figure,
        samples,
        {
            "$x_i$": "reference at tick $i$",
            r"$f_d$, $\zeta$": "damped frequency and damping ratio, estimated from $x^*_{i-1}$",
        },
    )
    return figure


def _draw_parts(panel: Axes) -> None:
    """The parts as boxes, with what goes between them."""
    panel.set_axis_off()
    panel.set(xlim=(-0.45, 3.75), ylim=(-1.25, 0.55))
    box = {"boxstyle": "round,pad=0.5", "facecolor": tint(FAINT, 0.15), "edgecolor": INK}
    arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.1}
    for place, words in enumerate(STEPS):
        last = place == len(STEPS) - 1
        panel.text(
            1.05 * place + 0.12,
            0.0,
            words,
            ha="center",
            va="center",
            fontsize=8.5,
            color=INK,
            bbox=None if last else box,
        )
        if not last:
            panel.annotate("", (1.05 * place + 0.72, 0.0), (1.05 * place + 0.56, 0.0), arrowprops=arrow)
    panel.annotate("", (-0.2, 0.0), (-0.42, 0.0), arrowprops=arrow)
    panel.text(-0.44, 0.22, "$x_i$", ha="left", fontsize=8.5, color=INK)
    panel.text(
        2.22, -1.0, r"Estimate $f_d$, $\zeta$", ha="center", va="center", fontsize=8.5, color=INK, bbox=box
    )
    panel.annotate("", (2.22, -0.3), (2.22, -0.7), arrowprops=arrow)
    panel.text(2.28, -0.55, "$I_i$", fontsize=8.5, color=INK)
    panel.plot([3.27, 3.27, 2.74], [-0.2, -1.0, -1.0], color=INK, linewidth=1.1)
    panel.annotate("", (2.68, -1.0), (2.9, -1.0), arrowprops=arrow)
    panel.text(3.33, -0.75, "$x^*_{i-1}$", fontsize=8.5, color=MUTED)


def _at(line: tvist_shaping.DelayLine, delay: float) -> float:
    """The reference a number of ticks ago, as the filter interpolates it [mrad]."""
    out = np.zeros(1)
    line.gather(np.ones(1), np.array([delay]), out)
    return 1e3 * float(out[0])


def _reference(tick: float) -> float:
    """Position of a joint that brakes with 2 rad/s² and stops at tick 0 [rad]."""
    return -0.5 * 2.0 * (PERIOD * min(tick, 0.0)) ** 2 + 2.0 * (PERIOD * BUFFERED) ** 2

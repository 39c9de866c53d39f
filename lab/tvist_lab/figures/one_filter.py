"""Figures 3, 7 and 8: effect of a shaper on a mode and a reference, and how a filter computes samples."""

from typing import Any

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
    dashed,
    dotted,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.recordings import Floats

PERIOD = 0.002  # control period [s]
ACCELERATION = 2.0  # acceleration of the references [rad/s²]
RISE = 0.15  # time in which the reference of figure 3 reaches its target [s]
BUFFERED = 22


def figure_3() -> Figure:
    """Draw ZV: its impulses, a mode's response to each and to both, and a reference before and after it."""
    f_d, zeta = 10.0, 0.1
    impulses = tvist_shaping.zv(f_d, zeta)
    time = np.linspace(0.0, 0.4, 801)
    figure, (sequence, responses, references) = panels(3, 5.6, ratios=(0.7, 1.0, 1.0))

    def response(time: Floats) -> Floats:
        omega, late = 2.0 * np.pi * f_d, np.maximum(time, 0.0)
        return np.asarray(np.exp(-omega * zeta / np.sqrt(1.0 - zeta**2) * late) * np.sin(omega * late))

    def reference(time: Floats) -> Floats:
        share = np.clip(time / RISE, 0.0, 1.0)
        return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))

    pairs = list(zip(impulses.A, impulses.tau, strict=True))
    for number, ((A, tau), style) in enumerate(zip(pairs, (OF_UNSHAPED, OF_THIRD), strict=True), 1):
        at = 1e3 * tau
        sequence.plot([at] * 2, [0.0, A], color=style.color, linewidth=2.0)
        sequence.plot([at], [A], **style.points(6.0))
        note(sequence, f"$A_{number}$ = {A:.3f} at $\\tau_{number}$ = {at:.0f} ms", (at, float(A)), (8, -4))
        responses.plot(1e3 * time, A * response(time - tau), **style.line(label=f"From $A_{number}$"))
    total, shaped = (sum(A * of(time - tau) for A, tau in pairs) for of in (response, reference))
    responses.plot(1e3 * time, total, **OF_SHAPED.line(1.8, label="Total"))
    references.plot(1e3 * time, reference(time), **OF_UNSHAPED.line())
    references.plot(1e3 * time, shaped, **OF_SHAPED.line(1.8))
    note(references, "$x$", (350.0 * RISE, float(reference(np.array(0.35 * RISE)))), (-10, 4))
    note(references, "$x^*$", (1e3 * RISE, float(np.interp(RISE, time, shaped))), (8, -8))
    sequence.set(ylabel="Amplitude (–)", ylim=(0.0, 0.75))
    responses.set(ylabel="Displacement (–)")
    references.set(ylabel="Reference (–)", xlabel="Time (ms)", xlim=(-4.0, 400.0))
    headings = ("Impulse sequence", "Response of the mode", "Reference")
    for panel, words in zip((sequence, responses, references), headings, strict=True):
        title(panel, words)
        dotted(panel, 1e3 * float(impulses.tau[1]), width=0.8)
    symbols = {
        r"$A_j$, $\tau_j$": "amplitude and time of an impulse",
        "$x$": "reference",
        "$x^*$": r"shaped reference, $\sum{A_j}\,x(t-\tau_j)$",
    }
    legend(figure, responses, symbols)
    return figure


def figure_7() -> Figure:
    """Draw ZV while f_d falls, with the delay of its second impulse rounded to ticks or exact.

    Top: the delay. Middle: deviation of the shaped reference from the exact one. Bottom: its acceleration.
    """
    duration, zeta, velocity, first = 0.06, 0.2, 1.5, 250
    time = PERIOD * np.arange(-2, round(duration / PERIOD) + 3, dtype=np.float64)
    trains = [tvist_shaping.zv(float(f_d), zeta) for f_d in 10.0 - 1.4 / duration * time]

    def reference(time: float) -> float:
        """Return the position of a joint that accelerates from rest [rad]."""
        ramp = velocity / ACCELERATION
        return 0.5 * ACCELERATION * min(time, ramp) ** 2 + velocity * max(time - ramp, 0.0)

    line = tvist_shaping.DelayLine(1, 200)
    line.fill([0.0])
    for tick in range(1, first - 2):
        line.push([reference(tick * PERIOD)])
    shaped, out = [], np.zeros(1)
    for now, one in enumerate(trains, first - 2):
        line.push([reference(now * PERIOD)])
        row = [float(one.A @ [reference(now * PERIOD - tau) for tau in one.tau])]
        for late in (np.round(one.tau / PERIOD), one.tau / PERIOD):
            line.gather(one.A, late, out)
            row.append(float(out[0]))
        shaped.append(row)
    exact, *both = np.array(shaped).T
    figure, (delays, errors, accelerations) = panels(3, 5.6)
    when, shown = 1e3 * time[2:-2], slice(2, -2)
    ticks = np.array([one.tau[1] / PERIOD for one in trains])[shown]
    delays.step(when, np.round(ticks), where="mid", **OF_UNSHAPED.line(label="Rounded to ticks"))
    delays.plot(when, ticks, **OF_SHAPED.line(1.8, label="Fractional delay"))
    for q, style in zip(both, (OF_UNSHAPED, OF_SHAPED), strict=True):
        dots = style.line(1.0, marker=style.marker, markersize=2.5)
        errors.plot(when, 1e3 * (q - exact)[shown], **dots)
        accelerations.plot(when, np.diff(q, 2)[1:-1] / PERIOD**2, **dots)
    dashed(accelerations, ACCELERATION)
    asked = 0.54 * when[-1], ACCELERATION
    note(accelerations, f"asked: {ACCELERATION:g} rad/s²", asked, (0, 6), ha="center")
    delays.set(ylabel=r"Delay $\tau_2$ (ticks)")
    errors.set(ylabel=r"Error of $q^*$ (mrad)")
    accelerations.set_yscale("symlog", linthresh=10.0)
    accelerations.set(
        xlim=(0.0, 1e3 * duration), ylim=(-400.0, 400.0), xlabel="Time (ms)", ylabel=r"$\ddot q^*$ (rad/s²)"
    )
    legend(
        figure,
        delays,
        {
            r"$\tau_2$": "delay of the second impulse",
            r"$q^*$, $\ddot q^*$": "shaped reference and its acceleration",
        },
    )
    return figure


def figure_8() -> Figure:
    """Draw how the filter computes one sample.

    Top: its parts. Middle: buffered samples, the interpolated reference, and the two delayed values that the
    impulses of this tick select. Bottom: the impulses.
    """
    impulses = tvist_shaping.zv(14.35, 0.14)  # the second one is between two ticks
    line = tvist_shaping.DelayLine(1, BUFFERED + 4)
    line.fill([0.0])
    for tick in range(-BUFFERED - 3, 1):  # the joint brakes and stops at tick 0
        line.push([0.5 * ACCELERATION * PERIOD**2 * (2 * BUFFERED**2 - tick**2)])
    out = np.zeros(1)

    def at(delay: float) -> float:
        """Return the reference `delay` ticks ago, as the filter interpolates it [mrad]."""
        line.gather(np.ones(1), np.array([delay]), out)
        return 1e3 * float(out[0])

    figure, (parts, samples, weights) = panels(3, 5.6, share_x=False, ratios=(0.55, 1.3, 0.75))
    _draw_parts(parts)
    ago, between = np.arange(BUFFERED), np.linspace(0.0, BUFFERED - 1, 421)
    delays = impulses.tau / PERIOD
    picked = [at(delay) for delay in delays]
    samples.plot(-ago, [at(float(k)) for k in ago], **OF_UNSHAPED.points(4.5, label="Buffered samples"))
    estimate = OF_THIRD.line(1.2, label="Interpolated reference, estimate of $x(t)$")
    samples.plot(-between, [at(k) for k in between], **estimate)
    hollow = {"markerfacecolor": "white", "zorder": 4}
    samples.plot(-delays, picked, **OF_SHAPED.points(7.0, label="Picked by the impulses", **hollow))
    shaped = float(impulses.A @ picked)
    samples.plot([0.0], [shaped], "D", color=INK, markersize=6.0, label="Shaped reference $x^*_i$", zorder=5)
    samples.tick_params(labelbottom=False)
    for number, (A, delay) in enumerate(zip(impulses.A, delays, strict=True), 1):
        weights.plot([-delay] * 2, [0.0, A], color=OF_SHAPED.color, linewidth=2.0)
        weights.plot([-delay], [A], **OF_SHAPED.points(5.0))
        side, away = ("right", -6) if number == 1 else ("left", 6)
        note(weights, f"$A_{number}$ = {A:.2f} at {delay:.2f} ticks", (-delay, A), (away, 3), ha=side)
        dotted(samples, -delay, width=0.8)
    samples.set(ylabel="Reference (mrad)", xlim=(-BUFFERED + 0.5, 1.5))
    weights.set(ylabel="Amplitude (–)", ylim=(0.0, 0.9), xlim=(-BUFFERED + 0.5, 1.5))
    weights.set_xlabel("Time from this tick (ticks of 2 ms)")
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
    """Draw the parts of the filter as boxes from input to output, with their signals."""
    panel.set_axis_off()
    panel.set(xlim=(-0.45, 3.75), ylim=(-1.25, 0.55))
    box = {"boxstyle": "round,pad=0.5", "facecolor": tint(FAINT, 0.15), "edgecolor": INK}
    arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.1}
    middle: Any = {"ha": "center", "va": "center"}
    for place, words in enumerate(("Buffer", "Interpolate", "Convolve")):
        panel.text(1.05 * place + 0.12, 0.0, words, bbox=box, **middle)
    panel.text(3.27, 0.0, "Shaped $x^*_i$", **middle)
    panel.text(2.22, -1.0, r"Estimate $f_d$, $\zeta$", bbox=box, **middle)
    panel.text(-0.44, 0.22, "$x_i$")
    panel.text(2.28, -0.55, "$I_i$")
    panel.text(3.33, -0.75, "$x^*_{i-1}$", color=MUTED)
    panel.plot([3.27, 3.27, 2.74], [-0.2, -1.0, -1.0], color=INK, linewidth=1.1)
    for start, end in (
        *[((start, 0.0), (start + 0.16, 0.0)) for start in (0.56, 1.61, 2.66)],
        ((-0.42, 0.0), (-0.2, 0.0)),
        ((2.22, -0.7), (2.22, -0.3)),
        ((2.9, -1.0), (2.68, -1.0)),
    ):
        panel.annotate("", end, start, arrowprops=arrow)

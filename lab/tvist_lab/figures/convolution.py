"""Figure 3: what a shaper of two impulses does to a mode, and to a reference."""

import numpy as np
from matplotlib.figure import Figure

import tvist_shaping
from tvist_lab.figures.style import OF_SHAPED, OF_THIRD, OF_UNSHAPED, dotted, legend, note, panels, title
from tvist_lab.recordings import Floats

F_D, ZETA = 10.0, 0.1
"""Damped frequency [Hz] and damping ratio [-] of the mode."""
DURATION = 0.4
"""Time shown [s]."""
RISE = 0.15
"""Time in which the reference reaches its end [s]."""


def figure_3() -> Figure:
    """Draw ZV: its impulses, the response of the mode to each and to both, and a reference before and after it."""
    impulses = tvist_shaping.zv(F_D, ZETA)
    time = np.linspace(0.0, DURATION, 801)
    figure, (sequence, responses, references) = panels(3, 5.6, ratios=(0.7, 1.0, 1.0))
    title(sequence, "Impulse sequence")
    for number, (A, tau, style) in enumerate(
        zip(impulses.A, impulses.tau, (OF_UNSHAPED, OF_THIRD), strict=True), 1
    ):
        sequence.plot([1e3 * tau] * 2, [0.0, A], color=style.color, linewidth=2.0)
        sequence.plot([1e3 * tau], [A], **style.points(6.0))
        note(
            sequence,
            f"$A_{number}$ = {A:.3f} at $\\tau_{number}$ = {1e3 * tau:.0f} ms",
            (1e3 * tau, float(A)),
            (8, -4),
        )
        responses.plot(1e3 * time, A * _response(time - tau), **style.line(1.4, label=f"From $A_{number}$"))
    total = sum(A * _response(time - tau) for A, tau in zip(impulses.A, impulses.tau, strict=True))
    sequence.set(ylabel="Amplitude (–)", ylim=(0.0, 0.75))
    title(responses, "Response of the mode")
    responses.plot(1e3 * time, total, **OF_SHAPED.line(1.8, label="Total"))
    responses.set(ylabel="Displacement (–)")
    title(references, "Reference")
    shaped = sum(A * _reference(time - tau) for A, tau in zip(impulses.A, impulses.tau, strict=True))
    references.plot(1e3 * time, _reference(time), **OF_UNSHAPED.line(1.4))
    references.plot(1e3 * time, shaped, **OF_SHAPED.line(1.8))
    note(references, "$x$", (1e3 * 0.35 * RISE, float(_reference(np.array(0.35 * RISE)))), (-10, 4))
    note(references, "$x^*$", (1e3 * RISE, float(np.interp(RISE, time, shaped))), (8, -8))
    references.set(ylabel="Reference (–)", xlabel="Time (ms)", xlim=(-4.0, 1e3 * DURATION))
    for panel in (sequence, responses, references):
        dotted(panel, 1e3 * float(impulses.tau[1]), width=0.8)
    legend(
        figure,
        responses,
        {
            r"$A_j$, $\tau_j$": "amplitude and time of an impulse",
            "$x$": "reference",
            "$x^*$": r"shaped reference, $\sum A_j\,x(t-\tau_j)$",
        },
    )
    return figure


def _response(time: Floats) -> Floats:
    """Displacement of the mode after an impulse at zero, scaled to an amplitude of one."""
    omega = 2.0 * np.pi * F_D
    sigma = omega * ZETA / np.sqrt(1.0 - ZETA**2)
    late = np.maximum(time, 0.0)
    return np.asarray(np.exp(-sigma * late) * np.sin(omega * late))


def _reference(time: Floats) -> Floats:
    """A reference that goes from 0 to 1 with a smooth velocity."""
    share = np.clip(time / RISE, 0.0, 1.0)
    return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))

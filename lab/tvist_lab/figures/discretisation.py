"""Figure 7: error of a shaped reference when a moving impulse is rounded to ticks."""

import numpy as np
from matplotlib.figure import Figure

import tvist_shaping
from tvist_lab.figures.style import OF_SHAPED, OF_UNSHAPED, dashed, legend, note, panels
from tvist_lab.recordings import Floats

PERIOD = 0.002
"""Tick [s]."""
ZETA = 0.2
"""Damping ratio of the mode shown [-]."""
F_D = (10.0, 8.6)
"""Damped frequency at the start and the end of the time shown [Hz]."""
VELOCITY = 1.5
"""Largest velocity of the reference [rad/s]."""
ACCELERATION = 2.0
"""Acceleration of the reference [rad/s²]."""
DURATION = 0.06
"""Time shown [s]."""


def figure_7() -> Figure:
    """Discretisation of a ZV shaper while f_d falls, with its second impulse rounded to ticks or between them.

    Top: the impulse's delay. Middle: deviation of the shaped reference from the exact one. Bottom: its acceleration.
    """
    ticks = round(DURATION / PERIOD)
    first = round(0.5 / PERIOD)
    time = PERIOD * np.arange(-2, ticks + 3, dtype=np.float64)
    f_d: Floats = F_D[0] + (F_D[1] - F_D[0]) / DURATION * time
    exact, rounded, fractional = _shape(first - 2, f_d)

    figure, (delays, errors, accelerations) = panels(3, 5.6)
    shown = slice(2, -2)
    tau = np.array([tvist_shaping.zv(f, ZETA).tau[1] for f in f_d]) / PERIOD
    when = 1e3 * time[shown]
    delays.step(when, np.round(tau[shown]), where="mid", **OF_UNSHAPED.line(label="Rounded to ticks"))
    delays.plot(when, tau[shown], **OF_SHAPED.line(1.8, label="Fractional delay"))
    delays.set(ylabel=r"Delay $\tau_2$ (ticks)")
    for q, style in ((rounded, OF_UNSHAPED), (fractional, OF_SHAPED)):
        dots = style.line(1.0, marker=style.marker, markersize=2.5)
        errors.plot(when, 1e3 * (q - exact)[shown], **dots)
        qdd = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / PERIOD**2
        accelerations.plot(when, qdd[1:-1], **dots)
    errors.set(ylabel=r"Error of $q^*$ (mrad)")
    dashed(accelerations, ACCELERATION)
    note(
        accelerations, f"asked: {ACCELERATION:g} rad/s²", (0.54 * when[-1], ACCELERATION), (0, 6), ha="center"
    )
    accelerations.set(
        xlabel="Time (ms)",
        ylabel=r"$\ddot q^*$ (rad/s²)",
        xlim=(0.0, 1e3 * DURATION),
        ylim=(-400.0, 400.0),
    )
    accelerations.set_yscale("symlog", linthresh=10.0)
    legend(
        figure,
        delays,
        {
            r"$\tau_2$": "delay of the second impulse",
            r"$q^*$, $\ddot q^*$": "shaped reference and its acceleration",
        },
    )
    return figure


def _shape(first: int, f_d: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the reference from a tick on, shaped exactly, with rounded delays and with fractional ones [rad]."""
    line = tvist_shaping.DelayLine(1, 200)
    line.fill([_reference(0.0)])
    shaped = []
    out = np.zeros(1)
    for tick in range(1, first + len(f_d)):
        line.push([_reference(tick * PERIOD)])
        if tick < first:
            continue
        impulses = tvist_shaping.zv(float(f_d[tick - first]), ZETA)
        exact = float(impulses.A @ [_reference(tick * PERIOD - tau) for tau in impulses.tau])
        row = [exact]
        for delays in (np.round(impulses.tau / PERIOD), impulses.tau / PERIOD):
            line.gather(impulses.A, delays, out)
            row.append(float(out[0]))
        shaped.append(row)
    exact_q, rounded, fractional = np.array(shaped).T
    return exact_q, rounded, fractional


def _reference(time: float) -> float:
    """Position of a joint that accelerates from rest [rad]."""
    time = max(time, 0.0)
    ramp = VELOCITY / ACCELERATION
    return 0.5 * ACCELERATION * min(time, ramp) ** 2 + VELOCITY * max(time - ramp, 0.0)

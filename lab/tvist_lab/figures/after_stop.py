"""Vibration of the tool after a motion: several curves, or one with its frequencies and decay."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import spectrogram

from tvist_lab.figures.recorded import Recorded
from tvist_lab.figures.style import (
    ALPHA,
    FAINT,
    INK,
    MUTED,
    OF_ALPHA,
    OF_SHAPED,
    OF_UNSHAPED,
    SERIES,
    dashed,
    dotted,
    legend,
    note,
    panels,
    remark,
    tint,
    title,
)
from tvist_lab.metrics import (
    NotMeasurableError,
    amplitude,
    best_tool_acceleration,
    motions,
    peak_after_stop,
    still_after,
)
from tvist_lab.metrics.common_clock import AFTER_STOP, STILL, acceleration_of
from tvist_lab.metrics.comparison import MotionChange
from tvist_lab.metrics.ring_down import WINDOWS, RingDown
from tvist_lab.metrics.table import ring_down_of
from tvist_lab.recordings import Floats, Recording

SHOWN = (-50.0, 350.0)  # time shown before and after the end of the unshaped motion's reference [ms]
HEADROOM = 1.6  # height of the axis relative to the larger peak, to show the end of braking [-]
WORDS_AT = 100.0  # time at which the names of the curves start [ms]
BEFORE, AFTER = 100.0, 600.0  # time shown before and after the stop of the first of several curves [ms]
BEFORE_S, AFTER_S = 0.1, 0.7  # time shown before and after the stop [s]
BLOCK = 0.2  # duration of the data for one spectrum of the spectrogram [s]; faster changes are blurred
HIGHEST = 45.0  # largest frequency shown [Hz]
RANGE = 40.0  # levels shown below the largest one [dB]
LINES = 4096  # number of samples to which the ring-down is padded for its spectrum


def after_stop_figure(unshaped: Recorded, shaped: Recorded, what: str) -> Figure:
    """Draw |α| around the end of one motion without and with shaping; time 0 is the unshaped reference's stop.

    Raises RecordingError without a true acceleration, NotMeasurableError if nothing was recorded after a stop.
    """
    recording, motion = unshaped
    length = float(recording.time[motion.reference_stop] - recording.time[motion.start])
    figure, (panel,) = panels(1, 3.9)
    title(panel, f"{what}: the tool's vibration after the same motion, without and with shaping")
    peaks = [peak_after_stop(*recorded) for recorded in (unshaped, shaped)]
    top = HEADROOM * max(*peaks, STILL)
    said = (
        f"without shaping: {peaks[0]:.2f} m/s²",
        f"with shaping: {peaks[1]:.2f} m/s², {MotionChange(*peaks).less()}",
    )
    rests: list[float | None] = []
    for (recording, motion), words, height, style in zip(
        (unshaped, shaped), said, (0.90, 0.76), (OF_UNSHAPED, OF_SHAPED), strict=True
    ):
        rows = slice(motion.start, motion.end)
        time = 1e3 * (recording.time[rows] - recording.time[motion.start] - length)
        alpha = amplitude(best_tool_acceleration(recording)[rows])
        shakes = time >= time[motion.shaped_stop - motion.start] + 1e3 * AFTER_STOP + 1e-6
        peak = float(time[shakes][np.argmax(alpha[shakes])]), float(np.max(alpha[shakes]))
        panel.plot(time, alpha, **style.line(1.8))
        panel.fill_between(time[shakes], alpha[shakes], color=tint(style.color), linewidth=0.0)
        panel.plot(*peak, "o", color=style.color, markersize=6, zorder=5)
        to_peak = {"arrowstyle": "-", "color": style.color, "shrinkB": 4, "relpos": (0.0, 0.5)}
        strong: Any = {"color": style.color, "fontsize": "x-large", "fontweight": "bold", "wrap": True}
        panel.annotate(
            words, peak, xytext=(WORDS_AT, height * top), va="center", arrowprops=to_peak, **strong
        )
        try:
            rests.append(1e3 * (still_after(recording, motion) - length))
        except NotMeasurableError:
            rests.append(None)
    panel.set(xlim=SHOWN, ylim=(0.0, top), ylabel="Acceleration of the tool (m/s²)")
    panel.set_xlabel("Time after the unshaped motion's end (ms)")
    dashed(panel, STILL, color=FAINT, width=0.9)
    _compare_rest(panel, *rests)
    note(panel, "braking", (SHOWN[0] + 5.0, 0.90 * top), color=MUTED)
    return figure


def _compare_rest(panel: Axes, before: float | None, after: float | None) -> None:
    """Mark the times at which the tool comes to rest, and the interval between them [ms]."""
    words = f"the tool is at rest (below {STILL:g} m/s²)"
    if before is not None and after is not None:
        for moment, style in ((before, OF_UNSHAPED), (after, OF_SHAPED)):
            panel.plot(
                [moment], [STILL], "|", color=style.color, markersize=14, markeredgewidth=2.2, zorder=5
            )
        arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.3, "shrinkA": 2, "shrinkB": 2}
        panel.annotate("", (after, STILL), (before, STILL), arrowprops=arrow, zorder=5)
        gained = before - after
        words += f"\n{abs(gained):.0f} ms {'earlier' if gained >= 0.0 else 'later'} with shaping"
    note(panel, words, (SHOWN[1], STILL), (0, 5), ha="right")


class ComparedPanel(NamedTuple):
    """A panel of `compared_figure`."""

    name: str
    curves: Mapping[str, Recorded]
    """Recorded motion of each curve, by the curve's name."""
    said: str = ""


def compared_figure(motions: Sequence[ComparedPanel], unshaped: Sequence[str] = ()) -> Figure:
    """Draw |α| of several motions, one panel each, on one scale; time 0 is the stop of a panel's first curve.

    Motions that cannot be drawn, and curve names beyond the eighth, are left out. If one curve is named in
    `unshaped`, it has the colour of unshaped motions. Raises NotMeasurableError if no motion can be drawn.
    """
    drawn = [(one, curves) for one in motions if (curves := _around_stop(one.curves))]
    if not drawn:
        raise NotMeasurableError("no motion has an acceleration to draw")
    columns = min(len(drawn), 2 if len(drawn) in (2, 4) else 3)
    rows = -(-len(drawn) // columns)
    figure, axes = panels(rows, 0.9 + 2.1 * rows, columns=columns, share_x=False, share_y=True)
    names = list(dict.fromkeys(name for _, curves in drawn for name in curves))
    # A single unshaped curve has the colour of unshaped motions.
    plain = [name for name in names if name in unshaped]
    alone = len(plain) == 1
    names = plain + [name for name in names if name not in plain] if alone else names
    styles = dict(zip(names, (OF_UNSHAPED, OF_SHAPED, *SERIES[2:]) if alone else SERIES, strict=False))
    highest = max(peak for _, curves in drawn for _, _, peak in curves.values())
    for place, (panel, (one, curves)) in enumerate(zip(axes, drawn, strict=False)):
        title(panel, one.name)
        for name in filter(curves.__contains__, styles):
            time, size, _ = curves[name]
            panel.plot(1e3 * time, size, **styles[name].line())
        dashed(panel, STILL, color=FAINT, width=0.9)
        panel.set(xlim=(-BEFORE, AFTER), ylim=(0.0, HEADROOM * highest), xlabel="Time after the stop (ms)")
        panel.set_ylabel(ALPHA if place % columns == 0 else "")
        if one.said:
            remark(panel, one.said, (0.97, 0.95), ha="right", va="top")
    for panel in axes[len(drawn) :]:
        panel.remove()
    for name, style in styles.items():
        axes[0].plot([], [], **style.line(label=name))
    legend(figure, axes[0], OF_ALPHA | {"dashed": f"at rest, {STILL:g} m/s²"})
    return figure


def _around_stop(recorded: Mapping[str, Recorded]) -> dict[str, tuple[Floats, Floats, float]]:
    """Return of each curve time after the first's stop [s], |α|, and its peak after its own stop [m/s²]."""
    curves = {}
    (first, motion), *_ = recorded.values()
    stop = float(first.time[motion.arm_stop(first)] - first.time[motion.start])
    for name, (recording, its) in recorded.items():
        with suppress(NotMeasurableError):
            time, alpha = acceleration_of(recording, its, slice(its.start, its.end), smooth=True)
            size, rests = amplitude(alpha), time >= recording.time[its.arm_stop(recording)] + AFTER_STOP
            late = time - recording.time[its.start] - stop
            curves[name] = (late, size, float(np.max(size[rests], initial=STILL)))
    return curves


def vibration_figure(unshaped: Recording, shaped: Recording, number: int) -> Figure:
    """Draw |α| of one move around its stop, unshaped and shaped."""
    curves = {name: (one, motions(one)[0]) for name, one in (("Unshaped", unshaped), ("Shaped", shaped))}
    return compared_figure([ComparedPanel(f"Move {number}", curves)], ["Unshaped"])


def ring_down_figure(name: str, recorded: Recorded) -> Figure:
    """Draw the tool's acceleration after a stop, the mode fitted to it, its spectrum and its spectrogram.

    Top: the axis that vibrates most, with the envelope of the fit. Middle: spectrum of all axes after the stop.
    Bottom: levels relative to the largest. Raises NotMeasurableError without accelerometer or enough rest.
    """
    recording, motion = recorded
    period = recording.period
    late, alpha = acceleration_of(recording, motion, slice(motion.start, motion.end))
    late = late - float(recording.time[motion.arm_stop(recording)])
    # Resample at even times around the stop, which fills in missing samples.
    ends = max(late[0], -BEFORE_S - BLOCK), min(late[-1], AFTER_S)
    time: Floats = period * np.arange(round(ends[0] / period), round(ends[1] / period) + 1)
    alpha = np.column_stack([np.interp(time, late, axis) for axis in alpha.T])
    after = time >= -0.5 * period
    ring = alpha[after] - alpha[after].mean(axis=0)
    if len(ring) * period < WINDOWS[0]:
        raise NotMeasurableError(
            f"only {len(ring) * period:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    fit = ring_down_of(recording, motion)
    figure, (course, spectrum, levels) = panels(3, 6.6, share_x=False, ratios=(1.0, 1.0, 1.4))
    title(course, name)

    along = (alpha - alpha[after].mean(axis=0)) @ np.linalg.svd(alpha[after], full_matrices=False)[2][0]
    course.plot(1e3 * time, along, **OF_SHAPED.line(1.1, label="Along its strongest axis"))
    words = "no mode is fitted"
    if fit.ok:
        decay = np.linspace(0.0, time[-1], 200)
        sigma = 2.0 * np.pi * fit.f_d * fit.zeta / np.sqrt(1.0 - fit.zeta**2)
        envelope = fit.amplitude * np.exp(-sigma * decay)
        course.plot(1e3 * decay, envelope, **OF_UNSHAPED.line(1.2, label="Envelope of the fit"))
        course.plot(1e3 * decay, -envelope, **OF_UNSHAPED.line(1.2))
        low, high = fit.zeta_interval
        words = f"$f_d$ = {fit.f_d:.2f} Hz, $\\zeta$ = {fit.zeta:.3f} (95 %: {low:.3f} to {high:.3f})"
    loudest = 1.3 * float(np.max(np.abs(along[after])))
    course.set(xlabel="Time after the stop (ms)", ylabel=r"$\alpha$ (m/s²)", ylim=(-loudest, loudest))
    course.set_xlim(-1e3 * BEFORE_S, 1e3 * time[-1])
    remark(course, words, (0.99, 0.95), ha="right", va="top")

    frequencies = np.fft.rfftfreq(LINES, period)
    size = np.linalg.norm(np.fft.rfft(ring, LINES, axis=0), axis=1) * period
    shown = frequencies <= HIGHEST
    spectrum.plot(frequencies[shown], size[shown], **OF_SHAPED.line(1.3))
    for mode in fit.found if fit.ok else ():
        weight, width = ("bold", 1.2) if mode.f_d == fit.f_d else ("normal", 0.6)
        spectrum.axvspan(*mode.f_d_interval, color=tint(OF_UNSHAPED.color), linewidth=0.0)
        spectrum.axvline(mode.f_d, **OF_UNSHAPED.line(width))
        top = {"xycoords": ("data", "axes fraction"), "weight": weight}
        note(spectrum, f"{mode.f_d:.1f}", (mode.f_d, 1.0), (3, -9), **top)
    spectrum.set(
        xlim=(0.0, HIGHEST), ylim=(0.0, None), xlabel="Frequency (Hz)", ylabel=r"Spectrum of $\alpha$ (m/s)"
    )

    _draw_levels(levels, time, alpha, fit)
    levels.set_xlim(-1e3 * BEFORE_S, 1e3 * (time[-1] - 0.5 * BLOCK))
    for panel in (course, levels):
        dotted(panel, 0.0)
    symbols = {
        r"$\alpha$": "acceleration of the tool, without gravity",
        "$f_d$": "damped frequency",
        r"$\zeta$": "damping ratio",
    }
    symbols |= {} if fit.ok else {"No mode": fit.reason}
    legend(figure, course, symbols | {"0 dB": f"largest level; a spectrum is of {1e3 * BLOCK:.0f} ms"})
    return figure


def _draw_levels(panel: Axes, time: Floats, alpha: Floats, fit: RingDown) -> None:
    period = float(time[1] - time[0])
    size = min(round(BLOCK / period), len(alpha))
    overlap, padded = size - max(size // 50, 1), max(512, 8 * size)
    frequencies, moments, each = spectrogram(
        alpha.T, 1.0 / period, window="hann", nperseg=size, noverlap=overlap, nfft=padded, detrend="constant"
    )
    moments, power = moments + time[0], each.sum(axis=0)
    shown = frequencies <= HIGHEST
    level = 10.0 * np.log10(power[shown] / float(power[:, moments >= 0.0].max()) + 1e-12)
    how: Any = {"cmap": "cividis", "vmin": -RANGE, "vmax": 0.0, "shading": "nearest", "rasterized": True}
    drawn = panel.pcolormesh(1e3 * moments, frequencies[shown], level, **how)
    if fit.ok:
        panel.axhline(fit.f_d, color="white", linewidth=1.2, linestyle=(0, (5, 3)))
        note(panel, "$f_d$", (1.0, fit.f_d), (-3, 3), xycoords=("axes fraction", "data"), ha="right")
    panel.grid(visible=False)
    panel.set(xlabel="Time after the stop (ms)", ylabel="Frequency (Hz)", ylim=(0.0, HIGHEST))
    panel.figure.colorbar(drawn, ax=panel, label="Level (dB)", pad=0.01)

"""Table 2 of the paper: metrics of each motion, their means over runs, and the impact of shaping."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from tvist_lab.metrics.agreed_modes import agreed_modes, lighter_beside
from tvist_lab.metrics.common_clock import (
    acceleration_of,
    peak_acceleration,
    still_after,
    vibration_after_stop,
)
from tvist_lab.metrics.measured_motion import servo_lag, still_driven
from tvist_lab.metrics.motion import MotionRows, motions
from tvist_lab.metrics.paper import Residual, Settling, residual, settling
from tvist_lab.metrics.ring_down import SIGNIFICANT, SKIP, SLOW_POLE, Mode, RingDown, fit_ring_down
from tvist_lab.metrics.vibration import NotMeasurableError
from tvist_lab.recordings import MissingColumnError, Recording

if TYPE_CHECKING:
    import polars as pl

COLUMNS = ("delay_ms", "stabilisation_ms", "cycle_ms", "overshoot_m", "residual_vibration_m_s2")
"""Columns of Table 2, in the paper's order."""
IMPACTS = {
    "stabilisation": "stabilisation_ms",
    "cycle": "cycle_ms",
    "overshoot": "overshoot_m",
    "residual_vibration": "residual_vibration_m_s2",
}  # impacts listed in the paper, and their columns

SKIP_OF_MEASURED = 0.03
"""Time after a stop that a ring-down ignores if the stop is found in measured angles, maybe too early [s]."""

Row: TypeAlias = dict[str, float | None]
Table: TypeAlias = dict[str, dict[str, Row]]
"""`unshaped`, `shaped` and `impact_percent` of each motion, structured like `table_2` in the paper's data."""
T = TypeVar("T")
Quantity = TypeVar("Quantity", float, "pl.Expr")


@dataclass(frozen=True)
class MotionResult:
    """Metrics of one motion; None if not measurable, with the reason in `notes`."""

    start_s: float
    """Time at which the reference starts [s]."""
    stop_s: float
    """Time at which the shaped reference stops [s]."""
    delay_ms: float | None = None
    """Δ: shaped minus unshaped duration of the reference [ms]."""
    stabilisation_ms: float | None = None
    """t_stb [ms]."""
    cycle_ms: float | None = None
    """t_cycle [ms]."""
    overshoot_m: float | None = None
    """e_os [m]."""
    residual_vibration_m_s2: float | None = None
    """RV [m/s²]; a note says if it is the largest |α| instead of a fitted decay."""
    still_after_ms: float | None = None
    """Last time at which |α| exceeds 0.1 m/s², from the start of the reference [ms]."""
    peak_m_s2: float | None = None
    """Largest |α| after the unshaped stop plus the declared delay, in a foreign log after the arm's own stop [m/s²]."""
    envelope_m_s2: float | None = None
    """Largest envelope of α within 3 to 60 Hz after the same time [m/s²]."""
    peak_acceleration_rad_s2: float | None = None
    """Largest |q̈*| of any joint during the motion [rad/s²]."""
    f_d_hz: float | None = None
    """Damped frequency of the ring-down [Hz]; if there are several modes, of the strongest after the stop."""
    f_d_interval_hz: tuple[float, float] | None = None
    """95 % interval of the frequency [Hz]."""
    zeta: float | None = None
    """Damping ratio of the same mode [-]."""
    zeta_interval: tuple[float, float] | None = None
    """95 % interval of the damping ratio [-]."""
    modes: Sequence[Mapping[str, Any]] = ()
    """Up to three modes, the strongest first: `f_d_hz` with `interval`, `zeta` with `zeta_interval`, and
    `amplitude`, the largest |α| at the stop [m/s²]."""
    servo_lag_ms: float | None = None
    """Time by which the measured angles follow the target [ms]."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Note about a field's value, by the field's name."""

    def as_dict(self) -> dict[str, Any]:
        """Convert the result to plain values for `tvist log analyze`."""
        return {**asdict(self), "notes": dict(self.notes)}


@dataclass(frozen=True)
class Runs:
    """Repetitions of one motion."""

    unshaped: Sequence[MotionResult]
    """At least one result."""
    shaped: Sequence[MotionResult]
    """At least one result."""


def analyze(recording: Recording) -> list[MotionResult]:
    """Measure all motions of a recording."""
    return [measure(recording, motion) for motion in motions(recording)]


def measure(recording: Recording, motion: MotionRows) -> MotionResult:
    """Measure one motion; metrics that cannot be computed are None with a note."""
    notes: dict[str, str] = {}
    if motion.stopped:
        notes["stop_s"] = "the motion was stopped before its target"
    if "target_q" not in recording:
        notes["start_s"] = notes["stop_s"] = (
            "found in actual_q, since the log has no target_q: good to about 20 ms"
        )
    shaping = "reference_q" in recording
    if not shaping:
        notes["delay_ms"] = "the log has no reference before shaping"

    def attempt(take: Callable[[Recording, MotionRows], T], *fields: str) -> T | None:
        try:
            return take(recording, motion)
        except NotMeasurableError as error:
            notes.update(dict.fromkeys(fields, str(error)))
        except MissingColumnError as error:
            notes.update(dict.fromkeys(fields, f"the log has no {error.column}"))
        return None

    settled: Settling | None = attempt(settling, "stabilisation_ms", "cycle_ms", "overshoot_m")
    vibration: Residual | None = attempt(residual, "residual_vibration_m_s2")
    still = attempt(still_after, "still_after_ms")
    after = attempt(vibration_after_stop, "peak_m_s2", "envelope_m_s2")
    strongest = attempt(peak_acceleration, "peak_acceleration_rad_s2")
    ringing = attempt(_ring_down, "f_d_hz", "f_d_interval_hz", "zeta", "zeta_interval")
    if ringing is not None and (doubt := _suspicion(ringing.found)):
        notes["zeta"] = doubt
    lag = motion.lag if recording.foreign else servo_lag(recording, motion.start, motion.shaped_stop)
    if lag is None:
        notes["servo_lag_ms"] = "no measured angles follow a target"
    if vibration is not None and not vibration.fitted:
        notes["residual_vibration_m_s2"] = "fewer than two peaks: the largest |α| after the stop"
    return MotionResult(
        start_s=float(recording.time[motion.start]),
        stop_s=float(recording.time[motion.shaped_stop]),
        delay_ms=1e3 * motion.delay(recording) if shaping else None,
        stabilisation_ms=None if settled is None else 1e3 * settled.stabilisation,
        cycle_ms=None if settled is None else 1e3 * settled.cycle,
        overshoot_m=None if settled is None else settled.overshoot,
        residual_vibration_m_s2=None if vibration is None else vibration.value,
        still_after_ms=None if still is None else 1e3 * still,
        peak_m_s2=None if after is None else after[0],
        envelope_m_s2=None if after is None else after[1],
        peak_acceleration_rad_s2=strongest,
        f_d_hz=None if ringing is None else ringing.f_d,
        f_d_interval_hz=None if ringing is None else ringing.f_d_interval,
        zeta=None if ringing is None else ringing.zeta,
        zeta_interval=None if ringing is None else ringing.zeta_interval,
        modes=() if ringing is None else tuple(map(_mode, ringing.found)),
        servo_lag_ms=None if lag is None else 1e3 * lag,
        notes=notes,
    )


def _ring_down(recording: Recording, motion: MotionRows) -> RingDown:
    fit = ring_down_of(recording, motion)
    if not fit.ok:
        raise NotMeasurableError(fit.reason)
    return fit


def _mode(mode: Mode) -> dict[str, Any]:
    return {
        "f_d_hz": mode.f_d,
        "interval": mode.f_d_interval,
        "zeta": mode.zeta,
        "zeta_interval": mode.zeta_interval,
        "amplitude": mode.amplitude,
    }


def _suspicion(modes: Sequence[Mode]) -> str:
    """Return a note if a mode is suspicious: a mode of similar frequency has much less damping."""
    for mode in modes:
        if (near := lighter_beside(mode, modes)) is not None:
            return (
                f"the damping of {mode.zeta:.2f} at {mode.f_d:.1f} Hz is doubtful beside {near.zeta:.2f} at "
                f"{near.f_d:.1f} Hz: the arm may still have been driven, or two modes may have been taken for one"
            )
    return ""


def ring_down_of(recording: Recording, motion: MotionRows) -> RingDown:
    """Fit the modes that vibrate after the stop; the result is the strongest one."""
    first = motion.arm_stop(recording)
    time, alpha = acceleration_of(recording, motion, slice(first, motion.end))
    late = time - recording.time[first]
    if recording.foreign:
        skip = SKIP if "target_q" in recording else SKIP_OF_MEASURED
        begin = max(skip, still_driven(recording, motion.start, first))
        return agreed_modes(alpha, late, recording.period, begin)
    return fit_ring_down(
        alpha, recording.period, modes=2, time=late, slow_poles=(SLOW_POLE,), evidence=SIGNIFICANT
    )


def table_2(runs: Mapping[str, Runs]) -> Table:
    """Return means over the runs, and the change by shaping, 100 (mean shaped / mean unshaped - 1) [%]."""
    # Runs in which a metric was not measurable are left out of its mean; values that are not defined are
    # None.
    table: Table = {}
    for name, repeated in runs.items():
        unshaped, shaped = _means(repeated.unshaped), _means(repeated.shaped)
        impact = {key: impact_percent(unshaped[column], shaped[column]) for key, column in IMPACTS.items()}
        table[name] = {"unshaped": unshaped, "shaped": shaped, "impact_percent": impact}
    return table


def table_notes(runs: Mapping[str, Runs]) -> list[str]:
    """Return the notes about the means in the table, each with the number of runs to which it applies."""
    found = []
    for name, repeated in runs.items():
        for kind, results in (("unshaped", repeated.unshaped), ("shaped", repeated.shaped)):
            for column in COLUMNS:
                notes = [result.notes[column] for result in results if column in result.notes]
                found += [
                    f"{name} {kind} {column}: {note} ({notes.count(note)} of {len(results)} runs)"
                    for note in dict.fromkeys(notes)
                ]
    return found


def _means(results: Sequence[MotionResult]) -> Row:
    row: Row = {}
    for column in COLUMNS:
        values = [value for result in results if (value := getattr(result, column)) is not None]
        row[column] = float(np.mean(values)) if values else None
    return row


def reduction_percent(before: Quantity, after: Quantity) -> Quantity:
    """Return by how much a number, or each number of a column, is less than before [%]."""
    return 100.0 * (1.0 - after / before)


def impact_percent(unshaped: float | None, shaped: float | None) -> float | None:
    """Return the change from the first to the second value [%]; None if it is not defined."""
    if unshaped is None or shaped is None or unshaped == 0.0:
        return None
    return 100.0 * (shaped / unshaped - 1.0)


@dataclass(frozen=True)
class MeasuredRecording:
    """A recording with its motions and their metrics."""

    recording: Recording
    motions: Sequence[MotionRows]
    results: Sequence[MotionResult]

    @classmethod
    def of(cls, recording: Recording) -> "MeasuredRecording":
        """Find and measure all motions."""
        found = motions(recording)
        return cls(recording, found, [measure(recording, motion) for motion in found])

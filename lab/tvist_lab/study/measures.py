"""Measures of a motion: the columns of a study's rows, with unit, meaning and computation."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from tvist_lab.metrics import (
    MotionRows,
    NotMeasurableError,
    best_tool_acceleration,
    envelope,
    in_motion_rms,
    motions,
    peak_acceleration,
    peak_after_stop,
    peak_velocity,
    rigid_acceleration,
    still_after,
)
from tvist_lab.metrics.common_clock import AFTER_STOP, STILL, Kinematics, peak_later_than
from tvist_lab.metrics.table import reduction_percent
from tvist_lab.recordings import Floats, Recording
from tvist_lab.study.case import Case
from tvist_lab.study.shaping import Shaped
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model
from tvist_plant.plant import PERIOD

WORTH = 0.2  # unshaped peak [m/s²] below which a move is listed, but not counted in percentages
QUIET_LEVEL = 0.02  # |α| below which an arm counts as at rest, by a stricter measure than `STILL` [m/s²]


class ExecutedMotion:
    """A motion that an arm has made, with the unshaped motion to compare it with."""

    def __init__(
        self,
        case: Case,
        shaped: Shaped,
        recording: Recording,
        unshaped: "Callable[[], ExecutedMotion]",
        like: "ExecutedMotion | None" = None,
    ) -> None:
        self.case, self.shaped, self.recording = case, shaped, recording
        self._unshaped, self._like = unshaped, like

    @cached_property
    def unshaped(self) -> "ExecutedMotion":
        """The unshaped motion, which may be this one."""
        return self._unshaped()

    @cached_property
    def rows(self) -> MotionRows:
        """Rows of the motion in its recording."""
        return motions(self.recording)[0] if self._like is None else self._like.rows

    @cached_property
    def rigid(self) -> Floats:
        """Acceleration of a rigid arm's flange along the shaped reference, see `rigid_acceleration` [m/s²]."""
        if self._like is not None:
            return self._like.rigid
        return rigid_acceleration(self.recording, self.rows, kinematics(self.case.description))

    @cached_property
    def peak(self) -> float:
        """Largest true |α| later than 10 ms after the reference stops [m/s²]."""
        return peak_after_stop(self.recording, self.rows)

    @cached_property
    def waited(self) -> float:
        """Largest true |α| of the unshaped motion, later than 10 ms after this motion's stop [m/s²]."""
        waiting = self.unshaped
        stop = self.recording.time[self.rows.shaped_stop] + AFTER_STOP
        return peak_later_than(waiting.recording, waiting.rows, min(stop, waiting.recording.time[-2]))

    @property
    def counts(self) -> bool:
        """Whether there is enough vibration for a percentage."""
        return self.unshaped.peak >= WORTH

    @cached_property
    def duration(self) -> float:
        """Duration of the shaped reference as the drives receive it [s]."""
        return self.rows.shaped_duration(self.recording)

    def still(self, threshold: float = STILL) -> float | None:
        """Return the settling time from the unshaped reference's start [s]; None if the arm never settles."""
        try:
            return still_after(self.recording, self.rows, threshold)
        except NotMeasurableError:
            return None

    def residual(self) -> float:
        """Return the largest envelope of α within 3 to 60 Hz after the unshaped stop plus the declared delay [m/s²]."""
        # The published target is one tick late.
        declared = self.recording["shaper_delay"][self.rows.reference_stop]
        after = self.rows.reference_stop + 1 + math.ceil(declared / self.recording.period - 1e-6)
        ringing = envelope(best_tool_acceleration(self.recording)[after + 1 :], self.recording.period)
        return float(ringing.max())

    def in_motion(self) -> float:
        """Return the rms of α relative to the rigid arm [m/s²]."""
        return in_motion_rms(self.recording, self.rows, self.rigid)


@dataclass(frozen=True)
class Measure:
    """A column of figures."""

    name: str
    unit: str  # unit; "–" for a ratio
    meaning: str
    of: Callable[[ExecutedMotion], float | None]  # measures a motion; None if not measurable or irrelevant


def _late(at: float | None, motion: ExecutedMotion) -> float | None:
    """Convert a time [s] to the time after the unshaped reference's stop [ms], since moves vary in length."""
    return None if at is None else round(1e3 * (at - motion.unshaped.duration), 6)


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1e3 * seconds, 6)


def _largest(q: Floats, order: int) -> float:
    return float(np.abs(np.diff(q, order, axis=0) / PERIOD**order).max())


def _since_stop(motion: ExecutedMotion) -> float | None:
    at = motion.still()
    return None if at is None else 1e3 * (at - motion.rows.duration(motion.recording))


_ALL = (
    Measure(
        "unshaped_peak_m_s2", "m/s²", "largest acceleration of the unshaped tool later than 10 ms after its stop",
        lambda motion: motion.unshaped.peak,
    ),
    Measure(
        "shaped_peak_m_s2", "m/s²", "the same of the shaped tool, after its own stop", lambda motion: motion.peak
    ),
    Measure(
        "reduction_percent", "%", "reduction of the peak; null if the unshaped peak is below 0.2 m/s²",
        lambda motion: reduction_percent(motion.unshaped.peak, motion.peak) if motion.counts else None,
    ),
    Measure(
        "less_than_waiting_percent", "%", "the same, compared with waiting until the shaped stop",
        lambda motion: reduction_percent(motion.waited, motion.peak) if motion.counts else None,
    ),
    Measure(
        "delay_ms", "ms", "how much later the shaped reference ends",
        lambda motion: _ms(motion.duration - motion.unshaped.duration),
    ),
    Measure(
        "unshaped_duration_ms", "ms", "duration of the unshaped reference",
        lambda motion: _ms(motion.unshaped.duration),
    ),
    Measure(
        "unshaped_still_after_ms", "ms", "time until the unshaped tool stays below 0.1 m/s²; null if it does not",
        lambda motion: _ms(motion.unshaped.still()),
    ),
    Measure(
        "shaped_still_after_ms", "ms", "the same of the shaped tool, from the start of the unshaped reference",
        lambda motion: _ms(motion.still()),
    ),
    Measure(
        "peak_acceleration_ratio", "–", "largest shaped q̈ relative to the limit",
        lambda motion: peak_acceleration(motion.recording, motion.rows) / motion.case.limits.acceleration,
    ),
    Measure(
        "peak_velocity_ratio", "–", "largest shaped q̇ relative to the limit",
        lambda motion: peak_velocity(motion.recording, motion.rows) / motion.case.limits.velocity,
    ),
    Measure(
        "waited_peak_m_s2", "m/s²", "largest acceleration of the unshaped tool later than 10 ms after the shaped stop",
        lambda motion: motion.waited,
    ),
    Measure(
        "still_after_unshaped_stop_ms", "ms",
        "time from the stop of the unshaped reference until the tool stays below 0.1 m/s²; null if it does not",
        lambda motion: _late(motion.still(), motion),
    ),
    Measure(
        "quiet_after_unshaped_stop_ms", "ms", "the same below 0.02 m/s²",
        lambda motion: _late(motion.still(QUIET_LEVEL), motion),
    ),
    Measure(
        "time_until_still_ms", "ms",
        "the same below 0.1 m/s², from the last sample of the reference before it enters the line",
        _since_stop,
    ),
    Measure(
        "residual_m_s2", "m/s²",
        "largest envelope of the tool's acceleration within 3 to 60 Hz after the declared end",
        ExecutedMotion.residual,
    ),
    Measure(
        "in_motion_m_s2", "m/s²", "rms of the tool's acceleration relative to that of a rigid arm",
        ExecutedMotion.in_motion,
    ),
    Measure(
        "declared_delay_ms", "ms", "delay of what the drives get, by the shaper's word",
        lambda motion: 1e3 * (motion.shaped.delay + (motion.shaped.elastic.delay if motion.shaped.elastic else 0.0)),
    ),
    Measure(
        "reference_acceleration_ratio", "–", "largest q̈ of the shaped samples relative to the limit",
        lambda motion: _largest(motion.shaped.q, 2) / motion.case.limits.acceleration,
    ),
    Measure(
        "reference_velocity_ratio", "–", "largest q̇ of the shaped samples relative to the limit",
        lambda motion: _largest(motion.shaped.q, 1) / motion.case.limits.velocity,
    ),
    Measure(
        "cost_us", "µs", "processor time of the shaper per tick",
        lambda motion: None if motion.shaped.cost is None else 1e6 * motion.shaped.cost,
    ),
)  # fmt: skip
MEASURES: Mapping[str, Measure] = MappingProxyType({one.name: one for one in _ALL})

OF_PEAKS = (
    "unshaped_peak_m_s2", "shaped_peak_m_s2", "reduction_percent", "less_than_waiting_percent", "delay_ms",
    "unshaped_duration_ms", "unshaped_still_after_ms", "shaped_still_after_ms", "peak_acceleration_ratio",
    "peak_velocity_ratio",
)  # fmt: skip
"""Measures that `evaluate` and sweeps use."""


def measured(motion: ExecutedMotion, names: Iterable[str]) -> dict[str, float | None]:
    """Measure a motion; see `MEASURES`."""
    return {name: MEASURES[name].of(motion) for name in names}


def kinematics(description: RobotDescription) -> Kinematics:
    """Return the kinematics of the rigid arm's flange."""
    model = rigid_model(description, Payload())
    data, flange = model.createData(), model.getFrameId(FLANGE)

    def at(q: Floats) -> tuple[Floats, Floats]:
        pin.forwardKinematics(model, data, q)
        placement = pin.updateFramePlacement(model, data, flange)
        return placement.translation.copy(), placement.rotation.copy()

    return at

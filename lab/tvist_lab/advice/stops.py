"""Recorded stops, and the vibration predicted if the reference had been a weighted sum of delayed copies.

A shaper makes such a sum of the reference, and a nearly linear arm responds with the same sum of
accelerations. After the last copy has stopped, the prediction uses only what was recorded after the stop,
when the arm is not driven. Vibration excited by the gears is no such sum, see `ripple`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tvist_lab.advice.ripple import Ripple, fitted, poles_of
from tvist_lab.metrics import MeasuredRecording, MotionResult, MotionRows, NotMeasurableError
from tvist_lab.metrics.common_clock import NOISE_PEAK, RINGS, STILL, acceleration_of
from tvist_lab.metrics.comparison import ends_of, same_ends
from tvist_lab.metrics.ring_down import fit_ring_down
from tvist_lab.metrics.vibration import low_pass_at
from tvist_lab.recordings import Floats, Recording
from tvist_shaping import Impulses

COUNTED_FROM = 0.02
"""Time after a stop from which vibration counts [s]; until then a filtered sensor still shows the braking."""
COUNTED = (0.2, 0.5)  # shortest and longest time for which vibration counts [s]
TAIL = 0.2  # time at the end of a rest from which the sensor's noise is found [s]
SAME_DURATION = 0.05  # largest relative difference between the durations of repetitions [-]
LOUD = 3.0  # smallest rms of a vibration over that of the sensor's noise [-]
NONLINEAR = 0.05
"""Share that always remains [-]: f_d of a real UR5 rises by 3 % during a ring-down, for which zv leaves 5 %."""
FELT = 0.05  # smallest rms of a vibration that is worth a shaper [m/s²]


class ResidualVibration(NamedTuple):
    """Vibration after a stop."""

    rms: float
    """rms of |α| from 20 ms after the stop, for up to 0.5 s, without the sensor's noise [m/s²]."""
    still: float
    """Time from the unshaped stop until |α| stays below 0.1 m/s² or the noise [s]; infinite if never."""


@dataclass(frozen=True, eq=False)
class StopWithRest:
    """The end of a motion, with the time at rest after it."""

    file: int
    number: int
    """Number of the motion in its file, from 1."""
    measured: MeasuredRecording
    motion: MotionRows
    result: MotionResult
    time: Floats
    """Evenly spaced times from the start of the motion on, relative to the arm's stop, shape (T,) [s]."""
    alpha: Floats
    """Acceleration of the tool below 60 Hz, shape (T, 3) [m/s²]."""
    q: Floats
    """Joint angles of the reference or, if not recorded, the measured ones, shape (T, n) [rad]."""
    noise: float
    """Mean square of the sensor's noise, summed over the axes [m²/s⁴]."""
    group: int = field(default=0)
    """Number that all repetitions of the same motion share."""

    @classmethod
    def of(cls, measured: MeasuredRecording, place: int, file: int = 0) -> "StopWithRest":
        """Cut a motion out of a measured log; raise NotMeasurableError if too little rest was recorded."""
        recording, motion = measured.recording, measured.motions[place]
        rows = slice(motion.start, motion.end)
        time, alpha = acceleration_of(recording, motion, rows)
        time = time - recording.time[motion.arm_stop(recording)]
        if not len(time) or time[-1] < COUNTED_FROM + COUNTED[0] + TAIL:
            rest = max(time[-1], 0.0) if len(time) else 0.0
            raise NotMeasurableError(
                f"only {rest:.2f} s of rest were recorded, {COUNTED_FROM + COUNTED[0] + TAIL:g} s are needed"
            )
        if not np.ptp(alpha[time > 0.0], axis=0).any():
            raise NotMeasurableError("the accelerometer shows the same value throughout the rest")
        even = np.arange(time[0], time[-1], recording.period)
        alpha = _at(even, time, low_pass_at(time, alpha, recording.period))
        late = recording.time[rows] - recording.time[motion.arm_stop(recording)]
        q = _at(even, late, recording[followed(recording)][rows])
        noise = _noise(alpha[even >= even[-1] - TAIL], recording.period)
        return cls(file, place + 1, measured, motion, measured.results[place], even, alpha, q, noise)

    def repeats(self, other: "StopWithRest") -> bool:
        """Whether both are the same motion at the same speed."""
        both = [(one.measured.recording, one.motion) for one in (self, other)]
        mine, theirs = (motion.duration(recording) for recording, motion in both)
        return abs(mine / theirs - 1.0) < SAME_DURATION and same_ends(*(ends_of(*one) for one in both))

    @cached_property
    def unshaped(self) -> ResidualVibration:
        """Recorded vibration."""
        return self.left(Impulses(np.ones(1), np.zeros(1)))

    @property
    def rings(self) -> bool:
        """Whether the vibration exceeds the noise and is large enough for a shaper."""
        return self.unshaped.rms > max(FELT, LOUD * math.sqrt(self.noise))

    @cached_property
    def _ripple(self) -> Ripple | None:
        modes = [(mode["f_d_hz"], mode["zeta"]) for mode in self.result.modes]
        return fitted(self.time, self.alpha, self.q, poles_of(modes)) if np.isfinite(self.q).all() else None

    @cached_property
    def _of_gears(self) -> Floats:
        """Acceleration excited by the gears in the recorded motion, shape (T, 3) [m/s²]."""
        return np.zeros_like(self.alpha) if self._ripple is None else self._waves(self._ripple, self.q)

    def _waves(self, ripple: Ripple, q: Floats) -> Floats:
        ends = np.array([self.q.min(axis=0), self.q.max(axis=0)])
        return ripple.along(q, ends, float(self.time[1] - self.time[0]))

    def after(self, impulses: Impulses, *, gears: bool = True) -> Floats:
        """Return the acceleration if impulses had shaped the reference, shape (T, 3) [m/s²].

        `gears` adds what the gears excite along the new path.
        """
        shaped = self._sum(self.alpha - self._of_gears, impulses)
        if gears and self._ripple is not None:
            shaped += self._waves(self._ripple, self._sum(self.q, impulses))
        return shaped

    def _sum(self, signal: Floats, impulses: Impulses) -> Floats:
        delays = impulses.tau
        moved = [[np.interp(self.time - delay, self.time, axis) for axis in signal.T] for delay in delays]
        return np.asarray(np.tensordot(impulses.A, moved, axes=1).T)

    def left(self, impulses: Impulses, *, gears: bool = True) -> ResidualVibration:
        """Return the predicted vibration, see `after`; raise NotMeasurableError if too little rest remains."""
        last = float(impulses.tau[-1])
        shaped, late = self.after(impulses, gears=gears), self.time - last - COUNTED_FROM
        counts = (late > 0.0) & (late <= COUNTED[1])
        if late[-1] < COUNTED[0]:
            raise NotMeasurableError("too little rest is left after the shaped stop")
        power = np.sum(shaped**2, axis=1)
        noise = self.noise * float(np.sum(np.square(impulses.A)))
        limit = max(STILL, NOISE_PEAK * (noise / 3.0) ** 0.5)
        loud = np.flatnonzero((late > 0.0) & (power > limit**2))
        still = float(self.time[loud[-1]]) if loud.size else last
        if loud.size and loud[-1] == len(late) - 1:
            still = np.inf
        least = (NONLINEAR * self.unshaped.rms) ** 2 if len(impulses.A) > 1 else 0.0
        return ResidualVibration((max(float(np.mean(power[counts])) - noise, 0.0) + least) ** 0.5, still)


def followed(recording: Recording) -> str:
    """Return the column of joint angles that is closest to the reference."""
    return next(one for one in ("reference_q", "target_q", "actual_q") if one in recording)


def _noise(tail: Floats, period: float) -> float:
    """Return the noise's mean square, summed over axes [m²/s⁴]; vibration in the tail is subtracted."""
    rings = fit_ring_down(tail, period, modes=2, offset=True, skip=0.0, window=TAIL)
    return 3.0 * rings.rms**2 if rings.r_squared > RINGS else float(np.sum(np.var(tail, axis=0)))


def _at(times: Floats, time: Floats, values: Floats) -> Floats:
    return np.column_stack([np.interp(times, time, axis) for axis in values.T])


def grouped(stops: Sequence[StopWithRest]) -> list[StopWithRest]:
    """Give repetitions of a motion the same `group`, and each stop the smallest noise found in its file."""
    firsts: list[StopWithRest] = []
    found = []
    for stop in stops:
        group = next((place for place, first in enumerate(firsts) if first.repeats(stop)), len(firsts))
        firsts += [stop] if group == len(firsts) else []
        noise = min(one.noise for one in stops if one.file == stop.file)
        found.append(replace(stop, group=group, noise=noise))
    return found

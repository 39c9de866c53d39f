"""What a zero-vibration shaper would leave of recorded vibration, predicted from other recordings of the same motion.

A shaper turns the reference into a weighted sum of delayed copies, and an arm that is nearly linear does the same with
its acceleration. So the recorded acceleration, convolved with the shaper, is that after the shaped motion. The modes
are those that leave least of the other motions, so that a prediction is no fit to what it predicts.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from tvist_lab.metrics.comparison import Way
from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.motion import MotionRows
from tvist_lab.metrics.ring_down import DAMPING, FREQUENCIES
from tvist_lab.metrics.table import Measured
from tvist_lab.recordings import Floats

LATE = 0.010
"""Time after a stop from which vibration counts [s]."""
COUNTED = (0.2, 0.5)
"""Shortest and longest time for which it counts [s]."""
SAME_DURATION = 0.05
"""Largest difference of the duration of repetitions, as a share of it [-]."""
ENOUGH = 4
"""Number of other repetitions from which the modes are found."""
TRIALS = 80
"""Largest number of shapers that are tried on them."""

Modes = Sequence[tuple[float, float]]
"""(f_d, ζ) of each [Hz, -]."""


class Predicted(NamedTuple):
    """What a shaper would leave of a motion's vibration."""

    f_d_hz: tuple[float, ...]
    """Frequencies of its modes [Hz]."""
    zeta: tuple[float, ...]
    """Their damping ratios [-]."""
    left_percent: float
    """rms of the acceleration later than 10 ms after the shaped stop, for up to 0.5 s, over that unshaped [%]."""
    peak_percent: float
    """The same of the largest acceleration [%]."""


class _Stop:
    """Acceleration of the tool before and after a stop.

    Raises:
        NotMeasurableError: The log has no accelerometer, or too little rest.
    """

    def __init__(self, measured: Measured, motion: MotionRows) -> None:
        recording = measured.recording
        time, self._alpha = felt(recording, motion, slice(motion.start, motion.end))
        self._time = time - recording.time[motion.arm_stop(recording)]
        if self._time[-1] < LATE + COUNTED[0]:
            raise NotMeasurableError(f"only {self._time[-1]:.2f} s were recorded after the stop")

    def left(self, modes: Modes) -> tuple[float, float]:
        """Return rms and peak after a shaped stop, over those unshaped [-].

        Raises:
            NotMeasurableError: Too little rest is left after the shaped stop.
        """
        sizes, delays = np.ones(1), np.zeros(1)
        for f_d, zeta in modes:
            later = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
            sizes = np.outer(sizes, [1.0, later]).ravel() / (1.0 + later)
            delays = np.add.outer(delays, [0.0, 0.5 / f_d]).ravel()
        shaped = np.zeros_like(self._alpha)
        for size, delay in zip(sizes, delays, strict=True):
            for axis in range(3):
                shaped[:, axis] += size * np.interp(self._time - delay, self._time, self._alpha[:, axis])
        before, after = self._size(self._alpha, 0.0), self._size(shaped, float(delays.max()))
        return after[0] / before[0], after[1] / before[1]

    def _size(self, alpha: Floats, stop: float) -> tuple[float, float]:
        counts = (self._time > stop + LATE) & (self._time <= stop + LATE + COUNTED[1])
        if np.count_nonzero(counts) < 2 or self._time[-1] < stop + LATE + COUNTED[0]:
            raise NotMeasurableError("too little rest is left after the shaped stop")
        size = np.linalg.norm(alpha[counts], axis=1)
        if not size.any():
            raise NotMeasurableError("the accelerometer felt nothing after the stop")
        return float(np.sqrt(np.mean(size**2))), float(size.max())


def predicted(measured: Measured, place: int) -> tuple[Predicted, ...]:
    """Predict what zero-vibration shapers for one and for two modes would leave of a motion's vibration.

    Args:
        measured: A measured log.
        place: Place of the motion among those of the log, from 0.

    Returns:
        One for a single mode, and one for two.

    Raises:
        NotMeasurableError: The log has no repetition of the motion whose modes are known, or too little rest.
    """
    motion, recording = measured.motions[place], measured.recording
    way, lasts = Way.of(recording, motion), motion.duration(recording)
    others = [
        other
        for other, one in enumerate(measured.motions)
        if other != place
        and measured.results[other].modes
        and abs(one.duration(recording) / lasts - 1.0) < SAME_DURATION
        and Way.of(recording, one).corresponds(way)
    ][:ENOUGH]
    if not others:
        raise NotMeasurableError("the log has no repetition of this motion whose modes are known")
    itself, stops = _Stop(measured, motion), [_Stop(measured, measured.motions[one]) for one in others]
    strongest = [(mode["f_d_hz"], mode["zeta"]) for mode in measured.results[others[0]].modes]
    if len(strongest) == 1:  # the second one is searched from an octave above
        strongest.append((2.0 * strongest[0][0], strongest[0][1]))
    return tuple(_prediction(itself, stops, strongest[:count]) for count in (1, 2))


def _prediction(itself: _Stop, others: Sequence[_Stop], start: Modes) -> Predicted:
    """Find the modes that leave least of the other stops, and predict this one's."""

    def modes(x: Floats) -> list[tuple[float, float]]:
        f_d = np.clip(np.exp(x[::2]), *FREQUENCIES)
        return list(zip(f_d.tolist(), np.clip(x[1::2], *DAMPING).tolist(), strict=True))

    def cost(x: Floats) -> float:
        return float(np.mean([stop.left(modes(x))[0] for stop in others]))

    first = np.array([value for f_d, zeta in start for value in (math.log(f_d), zeta)])
    steps = np.tile([0.05, 0.02], len(start))
    simplex = np.vstack([first, first + np.diag(steps)])
    search = {"maxfev": TRIALS, "initial_simplex": simplex}
    best = modes(minimize(cost, first, method="Nelder-Mead", options=search).x)
    rms, peak = itself.left(best)
    f_d, zeta = zip(*best, strict=True)
    return Predicted(f_d, zeta, 100.0 * rms, 100.0 * peak)

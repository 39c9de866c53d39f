"""Frequency of an arm by a log without an accelerometer: weak evidence, since joints hardly feel what the tool does."""

from collections.abc import Iterator, Sequence
from statistics import median

import numpy as np

from tvist_lab.metrics import Measured
from tvist_lab.metrics.agreed_modes import NEAR, agreed_modes
from tvist_lab.metrics.measured_motion import still_driven
from tvist_lab.metrics.ring_down import SKIP, WINDOWS

RIPPLES = ("actual_qd", "actual_current", "actual_moment", "actual_q")
"""Columns in which a joint shows that the arm shakes it."""
LIGHTEST = 0.005
"""Least damping ratio of an arm; what is damped less is a hum of the sensor [-]."""
AGREED = 2
"""Least number of motions that must show the same frequency."""


def frequency_of_joints(logs: Sequence[Measured]) -> tuple[float, int] | None:
    """Find the frequency with which encoders or currents swing after stops.

    Args:
        logs: Measured logs.

    Returns:
        Damped frequency [Hz], and the number of motions that show it; None if no two motions agree within 7 %.
    """
    seen = [(place, f_d) for place, found in enumerate(_swings(logs)) for f_d in found]
    groups = [[one for one in seen if abs(one[1] / middle - 1.0) <= NEAR] for _, middle in seen]
    best = max(groups, key=lambda group: len({place for place, _ in group}), default=[])
    count = len({place for place, _ in best})
    return (median(f_d for _, f_d in best), count) if count >= AGREED else None


def _swings(logs: Sequence[Measured]) -> Iterator[list[float]]:
    """Frequencies that the joints show after each motion [Hz]."""
    for log in logs:
        recording = log.recording
        for motion in log.motions:
            stop = motion.arm_stop(recording)
            time = recording.time[stop : motion.end] - recording.time[stop]
            begin = max(SKIP, still_driven(recording, motion.start, stop))
            found = []
            for name in filter(recording.__contains__, RIPPLES):
                values = recording[name][stop : motion.end]
                shown = np.isfinite(values).all(axis=1)
                if not shown.any() or time[shown][-1] < begin + WINDOWS[0]:
                    continue
                swing = values[shown] - values[shown][-len(values) // 3 :].mean(axis=0)
                fit = agreed_modes(swing, time[shown], recording.period, begin)
                found += [fit.f_d] if fit.ok and fit.zeta > LIGHTEST else []
            yield found

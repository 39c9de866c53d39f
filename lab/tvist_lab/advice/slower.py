"""What the same time would gain without a shaper: slower limits, or a smaller jerk."""

import math

import numpy as np

from tvist_lab.advice.stops import Stop
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.ring_down import decay_rate
from tvist_lab.recordings import Floats

COPIES = 48
"""Number of copies of the reference that stand for a running mean."""


def smoothed(stop: Stop, added: float) -> float | None:
    """What is left if the reference is smoothed by a running mean, which lowers its jerk [%].

    Args:
        stop: A recorded stop.
        added: Length of the running mean, by which the motion ends later [s], > 0.

    Returns:
        rms over that of the recorded motion; None if too little rest was recorded.
    """
    try:
        left = stop.left(np.full(COPIES, 1.0 / COPIES), np.linspace(0.0, added, COPIES))
    except NotMeasurableError:
        return None
    return 100.0 * left.rms / stop.unshaped.rms


def slowed(stop: Stop, added: float) -> float | None:
    """What the modes of a stop would have left if the whole motion were slower, so that it takes longer [%].

    A mode with poles λ is left with an amplitude in proportion to |∫ v(t) exp(λ* (t - T)) dt|, where v is the speed of
    the reference and T its end. Slowed by a factor k, that is the same integral with k λ.

    Args:
        stop: A recorded stop.
        added: Time by which the motion takes longer [s], >= 0.

    Returns:
        Root of the energy of the modes over that of the recorded motion; None if no modes or no joint angles are known.
    """
    time, speed = _speed(stop)
    if not stop.result.modes or time[-1] <= time[0]:
        return None
    slower = 1.0 + added / float(time[-1] - time[0])
    before = after = 0.0
    for mode in stop.result.modes:
        rate = decay_rate(mode["f_d_hz"], mode["zeta"])
        pole = complex(rate, 2.0 * math.pi * mode["f_d_hz"])
        energy = mode["amplitude"] ** 2 / rate
        excited = [
            abs(np.trapezoid(speed * np.exp(k * pole * (time - time[-1])), time)) for k in (1.0, slower)
        ]
        before += energy
        after += energy * float(excited[1] / excited[0]) ** 2
    return 100.0 * math.sqrt(after / before)


def _speed(stop: Stop) -> tuple[Floats, Floats]:
    """Time until the reference stops [s], and the speed of the joint that moves farthest [rad/s]."""
    recording, motion = stop.measured.recording, stop.motion
    rows = slice(motion.start, motion.reference_stop + 2)
    name = next(one for one in ("reference_q", "target_q", "actual_q") if one in recording)
    q, time = recording[name][rows], recording.time[rows]
    joint = int(np.argmax(np.ptp(q, axis=0)))
    return time, np.asarray(np.gradient(q[:, joint], time))

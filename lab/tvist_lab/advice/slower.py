"""What the same time would gain without a shaper: slower limits, or a smaller jerk."""

import math

import numpy as np

from tvist_lab.advice.options import left_of_modes
from tvist_lab.advice.stops import Stop, followed
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
    if time[-1] <= time[0]:
        return None
    slower = 1.0 + added / float(time[-1] - time[0])

    def excited(f_d: float, zeta: float, slowness: float) -> float:
        pole = slowness * complex(decay_rate(f_d, zeta), 2.0 * math.pi * f_d)
        return float(abs(np.trapezoid(speed * np.exp(pole * (time - time[-1])), time)))

    share = left_of_modes(stop, lambda f_d, zeta: excited(f_d, zeta, slower) / excited(f_d, zeta, 1.0))
    return None if share is None else 100.0 * share


def _speed(stop: Stop) -> tuple[Floats, Floats]:
    """Time until the reference stops [s], and the speed of the joint that moves farthest [rad/s]."""
    recording, motion = stop.measured.recording, stop.motion
    rows = slice(motion.start, motion.reference_stop + 2)
    q, time = recording[followed(recording)][rows], recording.time[rows]
    joint = int(np.argmax(np.ptp(q, axis=0)))
    return time, np.asarray(np.gradient(q[:, joint], time))

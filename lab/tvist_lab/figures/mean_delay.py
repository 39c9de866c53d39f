"""Effect of a varying mean delay: the same motion through a filter with varying delay and one with constant delay."""

import numpy as np
from matplotlib.figure import Figure

from tvist_controller.api.line import (
    JointLine,
    MotionLimits,
    load_calibration,
    modal_estimator,
    paper_payload,
    quickest_motion,
)
from tvist_lab.figures.style import INK, LIMIT, OF_SHAPED, OF_UNSHAPED, legend, panels
from tvist_lab.recordings import Floats
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping import BUILT_IN
from tvist_shaping.base import Filter

LIMITS = MotionLimits(1.5, 2.0, 100.0)
MODES = 3
"""Number of modes in the product of zero-vibration shapers."""
NAMES = ("zv of three modes", "auto, its mean delay constant")
AFTER = 100
"""Number of ticks shown after the reference has stopped."""


def mean_delay_figure() -> Figure:
    """A UR5e from Q3 to Q1: mean delay, velocity and acceleration of the shaped elbow, with two filters.

    Top: the mean delay. Middle and bottom: velocity and acceleration, with the reference's limits.
    """
    description = load("ur5e")
    payload, calibration = paper_payload(description), load_calibration("ur5e_modal")
    joints = description.joints
    filters = [
        BUILT_IN.make_filter(
            name,
            modal_estimator(calibration, description, payload, BUILT_IN.modes_of(name, MODES)),
            joints=joints,
        )
        for name in ("zv", "auto")
    ]
    start, end = (np.array(description.poses[name]) for name in ("Q3", "Q1"))
    figure, (delays, velocities, accelerations) = panels(3, 5.6)
    for tvist, style, name in zip(filters, (OF_UNSHAPED, OF_SHAPED), NAMES, strict=True):
        delay, q = _shape(tvist, start, end)
        time = PERIOD * np.arange(len(q))
        joint = int(np.argmax(np.abs(end - start)))
        along = (q[:, joint] - start[joint]) / (end - start)[joint] * abs(end - start).max()
        delays.plot(time, 1e3 * delay, **style.line(label=name))
        velocities.plot(time[1:], np.diff(along) / PERIOD, **style.line())
        accelerations.plot(time[1:-1], np.diff(along, 2) / PERIOD**2, **style.line())
    velocities.axhline(LIMITS.velocity, color=INK, linewidth=0.8, linestyle=LIMIT)
    for side in (-1.0, 1.0):
        accelerations.axhline(side * LIMITS.acceleration, color=INK, linewidth=0.8, linestyle=LIMIT)
    delays.set_ylabel("Mean delay (ms)")
    velocities.set_ylabel("Velocity (rad/s)")
    accelerations.set_ylabel("Acceleration (rad/s²)")
    accelerations.set_xlabel("Time (s)")
    legend(figure, delays)
    return figure


def _shape(tvist: Filter, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Mean delay [s] and shaped reference [rad] at each tick of a motion, shapes (N,) and (N, joints)."""
    motion = quickest_motion(JointLine(start, end), LIMITS, PERIOD)
    tvist.reset(start)
    delays: list[float] = []
    references: list[Floats] = []
    while not motion.finished or len(references) < motion.duration / PERIOD + AFTER:
        references.append(tvist.filter(motion.next()))
        delays.append(tvist.mean_delay)
    return np.array(delays), np.array(references)

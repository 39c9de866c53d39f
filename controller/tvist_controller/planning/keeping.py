"""Motions along straight lines in joint space whose shaped reference keeps the limits, found by shaping it ahead."""

from dataclasses import replace

import numpy as np

from tvist_controller.foresight.line_copy import MAX_AHEAD, LineSimulation
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.shaped_reference import ShapedReference
from tvist_controller.trajectory import JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Filter

EASY = MotionLimits(velocity=1.5, acceleration=2.0, jerk=100.0)
"""Limits up to which a filter's `excess` is sure, since it was determined there."""
TRIES = 4
"""Number of motions that are tried."""
SHARE = 1.0 - 1e-4
"""Share of the limit that is aimed at [-], since the peak changes a little with the motion."""


def keeping_motion(
    path: JointLine,
    limits: MotionLimits,
    tvist: Filter,
    speed: float = 1.0,
    agility: MotionLimits | None = None,
) -> PlannedMotion:
    """Return the quickest motion whose shaped reference keeps the limits.

    A filter whose weights change with the arm's posture adds the change of their spread to the acceleration, at most
    its `excess` at easy limits. Beyond these the motion is shaped ahead, and planned anew with as much less
    acceleration as it had too much.

    The limits are those of the shaped reference, for every joint; `speed` is the initial rate of the motion's time
    relative to the clock's [-]. The filter is not changed.

    Raises:
        ValueError: There is no such motion.
    """
    share = 1.0 - tvist.excess
    for _ in range(TRIES):
        spared = replace(limits, acceleration=limits.acceleration * share)
        motion = quickest_motion(path, spared, PERIOD, speed, agility)
        if tvist.excess == 0.0 or _is_easy(limits):
            break
        ahead = shaped_ahead(motion, tvist)
        if ahead is None:
            break
        most = float(np.abs(np.diff(ahead, 2, axis=0)).max(initial=0.0)) / PERIOD**2
        if most <= limits.acceleration:
            break
        share *= SHARE * limits.acceleration / most
    return motion


def shaped_ahead(motion: PlannedMotion, tvist: Filter) -> Floats | None:
    """References of the shaped motion at full rate, shape (k, n) [rad]; None if it lasts too long to simulate.

    Neither the motion, which has not begun, nor the filter is changed.
    """
    path, mine = motion.path, tvist.fork()
    shaped = ShapedReference(path.posture(path.start), PERIOD)
    shaped.enter(path.posture_of, path.start)
    line_filter = LineFilter(mine, motion.limits)
    line_filter.begin(mine, path.start, path.posture_of)
    mine.aim(path.end)
    ahead = LineSimulation(motion.paced_at(1.0), line_filter, shaped)
    ahead.until(MAX_AHEAD)
    return np.array(ahead.references) if ahead.rests else None


def _is_easy(limits: MotionLimits) -> bool:
    return (
        limits.velocity <= EASY.velocity
        and limits.acceleration <= EASY.acceleration
        and limits.jerk <= EASY.jerk
    )

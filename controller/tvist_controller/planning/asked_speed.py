"""Speeds that were asked for and are not reached, and which limit is why; that the way is too short is no reason."""

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.paths.pacing import JointLimits, shares
from tvist_controller.paths.route import Run
from tvist_controller.trajectory.retiming import RetimedLaw
from tvist_controller.trajectory.spline import SplineCurve
from tvist_plant.description import RobotDescription
from tvist_protocol.replies import Code

REACHED = 0.9
"""Share of the speed that counts as reached: a peak between two ramps of the acceleration stays a little lower [-]."""
BLUNTED = 3.0
"""The same ratio where the way is too short for the speed: ramps take a large part of a way of millimetres [-]."""
LATE = 1.01
"""Ratio of durations up to which a motion takes as long as asked [-]."""
BINDING = 0.95
"""Share of a limit from which on it is what makes a motion slower [-]."""
LOOKS = 65
"""Number of places of a curve at which the speed that the joints permit is looked at."""
LEAST = 1e-9
"""Smallest derivative that a speed is divided by [rad/m]."""


def slower_than_asked(
    run: Run, curve: SplineCurve, law: RetimedLaw, limits: JointLimits, description: RobotDescription
) -> tuple[Code, str] | None:
    """Say which limit keeps a motion along one segment from the speed or the duration that was asked for.

    Args:
        run: The segment.
        curve: The joints' way along it.
        law: Its time law.
        limits: Limits of the joints that the law keeps.
        description: The robot, for the limits' names.

    Returns:
        See `PlannedMove.limited`; None if it is as fast as asked, or if just the way is too short.
    """
    pacing, way = run[0].pacing, float(curve.end[0])
    if pacing.duration is not None:
        if law.duration <= LATE * pacing.duration:
            return None
        what = f"duration is {law.duration:.4g} s instead of {pacing.duration:.4g}"
        return _because(what, shares(law, law.moments, curve, limits), description)
    fastest = float(law.states(law.moments)[1].max())
    if fastest >= REACHED * pacing.velocity:
        return None
    what = f"velocity is {fastest:.4g} of {pacing.velocity:.4g} m/s"
    slope = np.abs(curve.derivatives(np.linspace(0.0, way, LOOKS))[1])
    permitted = float((limits.velocity / np.maximum(slope, LEAST)).min(axis=1).max())
    within_reach = min(pacing.velocity, (pacing.acceleration * way) ** 0.5)
    short = within_reach < pacing.velocity
    if short and within_reach <= min(permitted, BLUNTED * fastest):
        return None
    return _because(what, shares(law, law.moments, curve, limits), description)


def _because(what: str, used: tuple[Floats, Floats], description: RobotDescription) -> tuple[Code, str]:
    velocity, acceleration = used
    names, limits = description.robot.joints, description.limits
    if velocity.max() >= BINDING:
        joint = int(np.argmax(velocity))
        keeps = f"joint {names[joint]} stays within {limits.velocity[joint]:.4g} rad/s"
        return "limit_velocity", f"{what}, so that {keeps}"
    if acceleration.max() >= BINDING:
        joint = int(np.argmax(acceleration))
        keeps = f"joint {names[joint]} stays within {limits.acceleration[joint]:.4g} rad/s²"
        return "limit_acceleration", f"{what}, so that {keeps}"
    return "limit_acceleration", f"{what}, so that tool and joints stay within the limits of their jerk"

"""What is said of a motion that is slower than asked: which limit is why. That the way is too short is no reason."""

from typing import NamedTuple

import numpy as np

from tvist_controller.paths.pacing import JointLimits, shares
from tvist_controller.paths.route import Run
from tvist_controller.trajectory import MotionLimits, PlannedMotion
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
USED_UP = 0.95
"""Share of a limit from which on it is what makes a motion slower [-]."""
LOOKS = 65
"""Number of places of a curve at which the speed that the joints permit is looked at."""
LEAST = 1e-9
"""Smallest derivative that a speed is divided by [rad/m]."""


class Binding(NamedTuple):
    """A limit that makes a motion slower."""

    code: Code
    """The limit, for programs."""
    keeps: str
    """What is achieved, for people."""

    def makes(self, what: str) -> "Limited":
        """Say what it makes slower."""
        return self.code, f"{what}, so that {self.keeps}"


Limited = tuple[Code, str]
"""A limit, and a sentence on what it makes slower."""


_LIMITS: dict[str, tuple[Code, str, str]] = {
    "velocity": ("limit_velocity", "", "rad/s"),
    "acceleration": ("limit_acceleration", "", "rad/s²"),
    "torque": ("limit_torque", "the torque of ", "N m"),
}


def limit_of(quantity: str, joint: int, description: RobotDescription) -> Binding:
    """Return a joint's limit of velocity, acceleration or torque."""
    code, what, unit = _LIMITS[quantity]
    most = getattr(description.limits, quantity)[joint]
    return Binding(code, f"{what}joint {description.robot.joints[joint]} stays within {most:.4g} {unit}")


ARMS = Binding("limit_acceleration", "the joints stay within the arm's limits")
JERKS = Binding("limit_acceleration", "tool and joints stay within the limits of their jerk")


def slower_path(
    run: Run, curve: SplineCurve, law: RetimedLaw, limits: JointLimits, description: RobotDescription
) -> Limited | None:
    """Say which limit keeps a motion along one segment from the speed or the duration that was asked for.

    The law keeps the `limits` of the joints. None if it is as fast as asked, or if just the way is too short.
    """
    pacing, way = run[0].pacing, float(curve.end[0])
    if pacing.duration is not None:
        if law.duration <= LATE * pacing.duration:
            return None
        what = lasts(law.duration, pacing.duration)
    else:
        fastest = float(law.states(law.moments)[1].max())
        if fastest >= REACHED * pacing.velocity:
            return None
        what = f"velocity is {fastest:.4g} of {pacing.velocity:.4g} m/s"
        slope = np.abs(curve.derivatives(np.linspace(0.0, way, LOOKS))[1])
        permitted = float((limits.velocity / np.maximum(slope, LEAST)).min(axis=1).max())
        within_reach = min(pacing.velocity, (pacing.acceleration * way) ** 0.5)
        if within_reach < pacing.velocity and within_reach <= min(permitted, BLUNTED * fastest):
            return None
    velocity, acceleration = shares(law, law.moments, curve, limits)
    for quantity, used in (("velocity", velocity), ("acceleration", acceleration)):
        if used.max() >= USED_UP:
            return limit_of(quantity, int(np.argmax(used)), description).makes(what)
    return JERKS.makes(what)


def slower_joint_motion(motion: PlannedMotion, asked: MotionLimits) -> Limited | None:
    """Say that the jerk keeps a joint motion from the speed that was asked for, unless its way is too short for it."""
    way = float(np.abs(motion.path.end - motion.path.start).max())
    _, qd, _ = motion.states(motion.evenly(3))  # it is symmetric in time, so fastest in the middle
    fastest = float(np.abs(qd).max())
    if fastest >= REACHED * asked.velocity or asked.velocity**2 > asked.acceleration * way:
        return None
    jerk = Binding("limit_acceleration", f"the joints' jerk stays within {asked.jerk:.4g} rad/s³")
    return jerk.makes(f"velocity is {fastest:.4g} of {asked.velocity:.4g} rad/s")


def longer_joint_motion(motion: PlannedMotion, asked: float) -> Limited | None:
    """Say that a joint motion takes longer than the duration that was asked for [s], as the arm's limits require."""
    return None if motion.duration <= LATE * asked else ARMS.makes(lasts(motion.duration, asked))


def lasts(duration: float, asked: float) -> str:
    """Say how long a motion lasts instead of what was asked for [s]."""
    return f"duration is {duration:.4g} s instead of {asked:.4g}"

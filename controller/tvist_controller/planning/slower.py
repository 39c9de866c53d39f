"""Messages that name the limit making a motion slower than requested; none if only the way is too short."""

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
"""Fraction of the speed that counts as reached; a peak between two acceleration ramps stays a little lower [-]."""
BLUNTED = 3.0
"""On a way too short for the requested speed: tolerated ratio of peak without to peak with jerk limit [-]."""
DURATION_TOLERANCE = 1.01  # ratio of durations up to which a motion counts as on time [-]
USED_UP = 0.95  # fraction of a limit above which it is responsible [-]
SAMPLES = 65  # number of places of a curve at which the joints' permitted speed is computed
MIN_DERIVATIVE = 1e-9  # smallest derivative by which a speed is divided [rad/m]


class Binding(NamedTuple):
    """The limit that slows a motion down."""

    code: Code  # the limit, for programs
    keeps: str  # the limit, in words

    def makes(self, what: str) -> "Limited":
        """Return the limit with a message about what it slows down."""
        return self.code, f"{what}, so that {self.keeps}"


Limited = tuple[Code, str]  # a limit, and a message about what it slows down


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
    """Return the limit that prevents one segment's speed or duration; None if only its way is too short."""
    pacing, way = run[0].pacing, float(curve.end[0])
    if pacing.duration is not None:
        if law.duration <= DURATION_TOLERANCE * pacing.duration:
            return None
        what = lasts(law.duration, pacing.duration)
    else:
        fastest = float(law.states(law.moments)[1].max())
        if fastest >= REACHED * pacing.velocity:
            return None
        what = f"velocity is {fastest:.4g} of {pacing.velocity:.4g} m/s"
        slope = np.abs(curve.derivatives(np.linspace(0.0, way, SAMPLES))[1])
        permitted = float((limits.velocity / np.maximum(slope, MIN_DERIVATIVE)).min(axis=1).max())
        within_reach = min(pacing.velocity, (pacing.acceleration * way) ** 0.5)
        if within_reach < pacing.velocity and within_reach <= min(permitted, BLUNTED * fastest):
            return None
    velocity, acceleration = shares(law, law.moments, curve, limits)
    for quantity, used in (("velocity", velocity), ("acceleration", acceleration)):
        if used.max() >= USED_UP:
            return limit_of(quantity, int(np.argmax(used)), description).makes(what)
    return JERKS.makes(what)


def slower_joint_motion(motion: PlannedMotion, asked: MotionLimits) -> Limited | None:
    """Return a message if jerk prevents the requested speed, unless the way is too short for it."""
    way = float(np.abs(motion.path.end - motion.path.start).max())
    fastest = float(
        np.abs(motion.law.at(0.5 * motion.duration)[1]).max()
    )  # symmetric in time, so in the middle
    if fastest >= REACHED * asked.velocity or asked.velocity**2 > asked.acceleration * way:
        return None
    jerk = Binding("limit_acceleration", f"the joints' jerk stays within {asked.jerk:.4g} rad/s³")
    return jerk.makes(f"velocity is {fastest:.4g} of {asked.velocity:.4g} rad/s")


def longer_joint_motion(motion: PlannedMotion, asked: float) -> Limited | None:
    """Return a message if the arm's limits make a joint motion longer than requested [s]."""
    if motion.duration <= DURATION_TOLERANCE * asked:
        return None
    return ARMS.makes(lasts(motion.duration, asked))


def lasts(duration: float, asked: float) -> str:
    """Return a message about a duration other than requested [s]."""
    return f"duration is {duration:.4g} s instead of {asked:.4g}"

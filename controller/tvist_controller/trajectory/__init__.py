"""Sources of references: planned motions along paths, streams of set-points, stops."""

from tvist_controller.trajectory.base import (
    BrakingForecast,
    CheckedMotion,
    JointLine,
    MotionLimits,
    Path,
    Rest,
    SampledPositions,
    Trajectory,
)
from tvist_controller.trajectory.compliant import Compliant, ForceTask
from tvist_controller.trajectory.guided import Guided, ServoFollower, StuckError
from tvist_controller.trajectory.motion import DoubleS, PlannedMotion, TimedMotion, at_least, quickest_motion
from tvist_controller.trajectory.points import PointLaw
from tvist_controller.trajectory.speed import VelocityFollower
from tvist_controller.trajectory.stop import JointStop, PathStop, SlowedStop
from tvist_controller.trajectory.stream import SetpointStream

AnyStop = JointStop | PathStop | SlowedStop

__all__ = [
    "AnyStop",
    "BrakingForecast",
    "CheckedMotion",
    "Compliant",
    "DoubleS",
    "ForceTask",
    "Guided",
    "JointLine",
    "JointStop",
    "MotionLimits",
    "Path",
    "PathStop",
    "PlannedMotion",
    "PointLaw",
    "Rest",
    "SampledPositions",
    "ServoFollower",
    "SetpointStream",
    "SlowedStop",
    "StuckError",
    "TimedMotion",
    "Trajectory",
    "VelocityFollower",
    "at_least",
    "quickest_motion",
]

"""Sources of references: planned motions along paths, streams of set-points, stops."""

from tvist_controller.trajectory.base import Forecast, Known, Rest, Trajectory
from tvist_controller.trajectory.compliant import Compliant, ForceTask
from tvist_controller.trajectory.guided import Guided, Servo, StuckError
from tvist_controller.trajectory.limits import MotionLimits
from tvist_controller.trajectory.motion import DoubleS, PlannedMotion, at_least, quickest_motion
from tvist_controller.trajectory.path import JointLine, Path, Way
from tvist_controller.trajectory.speed import Speed
from tvist_controller.trajectory.stop import JointStop, PathStop, SlowedStop
from tvist_controller.trajectory.stream import SetpointStream

AnyStop = JointStop | PathStop | SlowedStop

__all__ = [
    "AnyStop",
    "Compliant",
    "DoubleS",
    "ForceTask",
    "Forecast",
    "Guided",
    "JointLine",
    "JointStop",
    "Known",
    "MotionLimits",
    "Path",
    "PathStop",
    "PlannedMotion",
    "Rest",
    "Servo",
    "SetpointStream",
    "SlowedStop",
    "Speed",
    "StuckError",
    "Trajectory",
    "Way",
    "at_least",
    "quickest_motion",
]

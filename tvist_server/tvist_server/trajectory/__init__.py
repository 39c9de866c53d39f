"""Sources of references: planned motions along paths, streams of set-points, stops."""

from tvist_server.trajectory.base import Forecast, Rest, Trajectory
from tvist_server.trajectory.curve import Bends, Curve
from tvist_server.trajectory.double_s import DoubleS
from tvist_server.trajectory.known import Known
from tvist_server.trajectory.limits import Limits
from tvist_server.trajectory.motion import Motion, quickest_motion
from tvist_server.trajectory.path import JointLine, Path, Posture, Way
from tvist_server.trajectory.path_stop import PathStop
from tvist_server.trajectory.stop import Stop
from tvist_server.trajectory.stream import SetpointStream

__all__ = [
    "Bends",
    "Curve",
    "DoubleS",
    "Forecast",
    "JointLine",
    "Known",
    "Limits",
    "Motion",
    "Path",
    "PathStop",
    "Posture",
    "Rest",
    "SetpointStream",
    "Stop",
    "Trajectory",
    "Way",
    "quickest_motion",
]

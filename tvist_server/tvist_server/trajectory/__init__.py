"""Where references come from: point-to-point motions, streams of set-points, stops."""

from tvist_server.trajectory.base import Limits, Line, Rest, Trajectory
from tvist_server.trajectory.double_s import DoubleS
from tvist_server.trajectory.known import Known
from tvist_server.trajectory.line_stop import LineStop
from tvist_server.trajectory.stop import Stop
from tvist_server.trajectory.stream import SetpointStream

__all__ = ["DoubleS", "Known", "Limits", "Line", "LineStop", "Rest", "SetpointStream", "Stop", "Trajectory"]

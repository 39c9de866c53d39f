"""Where references come from: point-to-point motions, streams of set-points, stops."""

from tvist_server.trajectory.base import Limits, Rest, Trajectory
from tvist_server.trajectory.double_s import DoubleS
from tvist_server.trajectory.stop import Stop
from tvist_server.trajectory.stream import SetpointStream

__all__ = ["DoubleS", "Limits", "Rest", "SetpointStream", "Stop", "Trajectory"]

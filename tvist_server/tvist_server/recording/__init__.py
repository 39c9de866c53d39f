"""Recording: every tick and everything that reached the controller, into an MCAP file."""

from tvist_server.recording.recorder import Recorder, RecorderError

__all__ = ["Recorder", "RecorderError"]

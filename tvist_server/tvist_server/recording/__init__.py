"""Recording of every tick, and of everything that reached the controller, to an MCAP file."""

from tvist_server.recording.recorder import Recorder, RecorderError

__all__ = ["Recorder", "RecorderError"]

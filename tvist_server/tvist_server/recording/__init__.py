"""Recording: every tick and everything that reached the controller, into an MCAP file."""

from tvist_server.recording.recorder import Recorder, RecordingError

__all__ = ["Recorder", "RecordingError"]

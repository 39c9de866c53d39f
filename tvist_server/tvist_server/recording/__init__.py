"""Recording of every tick, and of everything that reached the controller, to an MCAP file."""

from tvist_server.recording.errors import RecorderError

__all__ = ["RecorderError"]

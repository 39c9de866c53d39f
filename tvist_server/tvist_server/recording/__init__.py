"""Recording of every tick, and of everything that reached the controller, to MCAP files."""

from tvist_controller.instruments.report import Report
from tvist_protocol.errors import TvistError
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, Truth

Kept = Report | Event | Truth | Io | Entry
"""What waits for the writer: of a tick its report, since its state takes a while to make."""


class RecorderError(TvistError):
    """A recording cannot be started."""


__all__ = ["Kept", "RecorderError"]

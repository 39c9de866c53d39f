"""Records every tick, and everything that reached the controller, to MCAP files."""

from tvist_controller.instruments.report import Report
from tvist_protocol.errors import TvistError
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, Truth

Kept = Report | Event | Truth | Io | Entry
"""Items queued for the writer; a tick is queued as its report, because its state takes time to build."""


class RecorderError(TvistError):
    """A recording cannot be started."""


__all__ = ["Kept", "RecorderError"]

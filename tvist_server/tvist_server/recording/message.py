"""What a recording keeps."""

from tvist_controller.instruments.report import Report
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, Truth

Kept = Report | Event | Truth | Io | Entry
"""What waits for the writer: of a tick its report, since its state takes a while to make."""

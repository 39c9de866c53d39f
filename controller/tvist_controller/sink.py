"""What takes the messages that a controller puts out."""

from typing import Literal

from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, State, Truth

Topic = Literal["state", "event", "truth", "telemetry", "io"]
"""What is told without being asked for."""


class Sink:
    """Takes messages in the controller's thread. Nothing here may raise, and nothing may wait but in lockstep.

    Each method lets its message go unless it is overridden.
    """

    def state(self, state: State) -> None:
        """Take a tick's state."""

    def event(self, event: Event) -> None:
        """Take an event; it comes before the state of its tick."""

    def truth(self, truth: Truth) -> None:
        """Take what no robot can know, where that is told."""

    def io(self, io: Io) -> None:
        """Take inputs, outputs and registers, where they changed; they come before the state of their tick."""

    def journal(self, entry: Entry) -> None:
        """Take what reached the controller before the tick of that number."""

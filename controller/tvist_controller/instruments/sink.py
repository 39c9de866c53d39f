"""Receiver of the messages that a controller produces."""

from typing import Literal

from tvist_controller.instruments.report import Report
from tvist_protocol.io import Io
from tvist_protocol.journal import Entry
from tvist_protocol.stream import Event, State, Truth

Topic = Literal["state", "event", "truth", "telemetry", "io"]
"""Topic of messages that are published without a request."""


class Sink:
    """Takes messages in the controller's thread. No method may raise, and none may block except in lockstep.

    By default each method ignores its message.
    """

    wants_truth = False
    """Whether it asks for what a real robot cannot measure just now, although the robot does not publish it."""

    def report(self, report: Report) -> None:
        """Take a tick's report, by default as its state, which takes a while to make."""
        self.state(report.state)

    def state(self, state: State) -> None:
        """Take a tick's state."""

    def event(self, event: Event) -> None:
        """Take an event; it comes before the state of its tick."""

    def truth(self, truth: Truth) -> None:
        """Take what a real robot cannot measure, if it is published or this sink wants it."""

    def io(self, io: Io) -> None:
        """Take changed inputs, outputs and registers; they precede the state of their tick."""

    def raised(self, error: Exception) -> None:
        """Take what a plant, a function of a program or a tick has raised, for a log; the robot has dealt with it."""

    def journal(self, entry: Entry) -> None:
        """Take an input of the controller, which precedes the tick of its number."""

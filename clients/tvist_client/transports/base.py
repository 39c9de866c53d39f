"""What a client needs of a network: bytes to one robot, and bytes from it."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Literal

from tvist_client.errors import NotConnectedError

Topic = Literal["state", "event", "truth", "telemetry", "io"]
"""What a robot puts without being asked."""


class Transport(ABC):
    """A way to one robot. Used from one event loop, on which it also calls back."""

    @abstractmethod
    async def request(self, data: bytes, timeout_s: float) -> bytes:
        """Send an encoded command and wait for its encoded reply.

        Args:
            data: The command.
            timeout_s: How long the robot may take [s].

        Raises:
            NotConnectedError: The robot does not answer, or disconnected meanwhile.
            AnswerTimeoutError: The answer took longer than `timeout_s`.
        """

    @abstractmethod
    def put_setpoint(self, data: bytes) -> None:
        """Send an encoded set-point, which nobody answers.

        Raises:
            NotConnectedError: The transport is closed.
        """

    @abstractmethod
    async def info(self) -> bytes:
        """Ask for the encoded `info`; raises as `request` does."""

    @abstractmethod
    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Have every message of a topic handed to a callback on the event loop, in order, until `close`."""

    @abstractmethod
    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Have a callback called on the event loop each time the robot goes away."""

    @abstractmethod
    async def announce(self, client: str) -> None:
        """Say that a client of that name is there, until it was withdrawn as often or this transport ends."""

    @abstractmethod
    async def withdraw(self, client: str) -> None:
        """Take back what one `announce` said."""

    @abstractmethod
    async def close(self) -> None:
        """End; a second call does nothing."""

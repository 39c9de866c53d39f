"""Interface of transports, which carry bytes between a client and one robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Literal

from tvist_client.errors import NotConnectedError

Topic = Literal["state", "event", "truth", "telemetry", "io"]
"""Topic that a robot publishes without a request."""


class Transport(ABC):
    """A connection to one robot, used from one event loop, on which its callbacks run too."""

    @abstractmethod
    async def request(self, data: bytes, timeout_s: float) -> bytes:
        """Send an encoded command and wait for its encoded reply.

        Args:
            data: Encoded command.
            timeout_s: Longest wait for the answer [s].

        Raises:
            NotConnectedError: The robot does not answer, or disconnected meanwhile.
            DeniedError: The robot takes no commands from this client.
            AnswerTimeoutError: The answer took longer than `timeout_s`.
        """

    @abstractmethod
    def put_setpoint(self, data: bytes) -> None:
        """Send an encoded set-point, which is not answered; raise NotConnectedError if the transport is closed."""

    @abstractmethod
    async def info(self) -> bytes:
        """Request the encoded `info`; raises the same errors as `request`."""

    @abstractmethod
    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Call a function with every message of a topic, on the event loop and in order, until `close`."""

    @abstractmethod
    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Call a function on the event loop each time the robot disconnects."""

    @abstractmethod
    def presence(self, client: str) -> AbstractContextManager[object]:
        """Announce a client's presence for the duration of a block, or until the transport is closed."""

    @abstractmethod
    async def close(self) -> None:
        """Close the transport; a second call does nothing."""

"""What the gateway needs of a ROS 2 node, over Zenoh alone or through an installed ROS 2."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from typing import Any

from tvist_ros2.cdr import CdrError, decode
from tvist_ros2.messages import RosType
from tvist_ros2.names import DEFAULT, Qos

Answer = Callable[[Any], Coroutine[Any, Any, Any]]  # takes a request and returns the response


class Node(ABC):
    """A node, used from one event loop, on which its callbacks run too.

    A name that does not begin with / is in the node's namespace.
    """

    warn: Callable[[str], None]
    """Called with the reason if a message cannot be read; set it before the first subscription."""

    @abstractmethod
    def publisher(self, name: str, of: RosType, qos: Qos = DEFAULT) -> Callable[[Any], None]:
        """Announce a topic; return the function that publishes a message on it."""

    @abstractmethod
    def subscribe(self, name: str, of: RosType, callback: Callable[[Any], None]) -> None:
        """Call a function with every message of a topic."""

    @abstractmethod
    def serve(self, name: str, of: RosType, answer: Answer) -> None:
        """Answer a service with the result of a function of the request, which may take any time."""

    def deliver(self, name: str, of: RosType, callback: Callable[[Any], None], data: bytes) -> None:
        """Call a function with an encoded message of a topic, or warn if it cannot be read."""
        try:
            callback(decode(of.request, data))
        except CdrError as error:
            self.warn(f"an invalid message on {name}: {error}")

    @abstractmethod
    async def close(self) -> None:
        """Leave the network."""

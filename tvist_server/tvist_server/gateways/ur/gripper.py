"""One client of the gripper of a cell, on the port of Robotiq's URCap."""

from collections.abc import Callable

from tvist_controller.cell.gripper import Requests
from tvist_server.gateways.ur.base import PortSession, Send

AskGripper = Callable[[bytes, Callable[[bytes], None]], None]
"""Has a request carried out between two ticks; the answer comes in another thread."""


class GripperSession(PortSession):
    """Passes requests to the gripper in the controller, one after the other.

    Args:
        ask: Has a request carried out.
        send: Sends data to the client.
        soon: Has an answer handled in the interfaces' thread, where the client may go on sending.
    """

    client_begins = True

    def __init__(self, ask: AskGripper, send: Send, soon: Callable[[Callable[[], None]], None]) -> None:
        self._ask, self._send, self._soon = ask, send, soon
        self._requests = Requests()
        self._unanswered = 0

    @property
    def waiting(self) -> int:
        """Number of requests that have not been answered."""
        return self._unanswered

    def receive(self, data: bytes) -> None:
        """Pass on the requests that are complete with these bytes."""
        for request in self._requests.cut(data):
            self._unanswered += 1
            self._ask(request, lambda answer: self._soon(lambda: self._answered(answer)))

    def _answered(self, answer: bytes) -> None:
        self._unanswered -= 1
        if not self.over:
            self._send(answer)

    def closed(self) -> None:
        self.over = True

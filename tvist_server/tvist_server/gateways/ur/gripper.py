"""One client of the cell's gripper, on the port of Robotiq's URCap."""

from collections.abc import Callable
from dataclasses import dataclass, field

from tvist_controller.cell.gripper import Requests
from tvist_server.gateways.ur.base import PortSession

AskGripper = Callable[[bytes, Callable[[bytes], None]], None]
"""Passes a request to the cell's gripper between two ticks; the answer's callback runs in another thread."""


@dataclass(eq=False)
class GripperSession(PortSession):
    """Passes requests to the gripper in the controller."""

    only_answers = True
    waiting = 0
    _ask: AskGripper
    _soon: Callable[[Callable[[], None]], None]  # runs a function in the interfaces' thread
    _requests: Requests = field(default_factory=Requests, init=False)

    def receive(self, data: bytes) -> None:
        for request in self._requests.cut(data):
            self.waiting += 1
            self._ask(request, lambda answer: self._soon(lambda: self._answered(answer)))

    def _answered(self, answer: bytes) -> None:
        self.waiting -= 1
        if not self.over:
            self._control.deliver(lambda: self._send(answer))

"""One client of the cell's gripper, on the port of Robotiq's URCap."""

from collections.abc import Callable

from tvist_controller.cell.gripper import Requests
from tvist_server.gateways.ur.base import PortSession, Send
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.robot import UrRobot

AskGripper = Callable[[bytes, Callable[[bytes], None]], None]
"""Carries out a request between two ticks; the answer comes in another thread."""


class GripperSession(PortSession):
    """Passes requests to the gripper in the controller; `soon` runs a function in the interfaces' thread."""

    client_begins = True
    waiting = 0

    def __init__(
        self,
        robot: UrRobot,
        control: ConnectionControl,
        send: Send,
        ask: AskGripper,
        soon: Callable[[Callable[[], None]], None],
    ) -> None:
        super().__init__(robot, control, send)
        self._ask, self._soon = ask, soon
        self._requests = Requests()

    def receive(self, data: bytes) -> None:
        for request in self._requests.cut(data):
            self.waiting += 1
            self._ask(request, lambda answer: self._soon(lambda: self._answered(answer)))

    def _answered(self, answer: bytes) -> None:
        self.waiting -= 1
        if not self.over:
            self._control.hear(lambda: self._send(answer))

"""One client of the primary or the secondary interface."""

from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.stream import Event
from tvist_server.gateways.ur import messages, version
from tvist_server.gateways.ur.base import ControllerAccess, PortSession, Send
from tvist_server.gateways.ur.messages import ErrorLevel
from tvist_server.gateways.ur.primary.orders import Orders
from tvist_server.gateways.ur.primary.packages import robot_state
from tvist_server.gateways.ur.primary.scripts import Intake
from tvist_server.gateways.ur.robot import UrRobot

EVERY: Final = 50
"""Ticks between two robot states: 10 Hz."""


class PrimarySession(PortSession):
    """Sends a client the robot's state and messages, and takes its commands.

    The secondary interface is the same without messages, as on UR's controllers: some of its clients expect nothing but
    the state.

    Args:
        robot: The robot.
        control: Access to its controller.
        send: Sends data to the client.
        read_only: Whether what the client sends is declined.
        informed: Whether the client gets messages.
    """

    def __init__(
        self,
        robot: UrRobot,
        control: ControllerAccess,
        send: Send,
        *,
        read_only: bool = False,
        informed: bool = True,
    ) -> None:
        self._robot = robot
        self._send = send
        self._read_only = read_only
        self.informed = informed
        """Whether the client gets messages."""
        self._intake = Intake()
        self._orders = Orders(robot, control, self._tell)
        self._errors: list[bytes] = []
        """Error codes of this tick, which follow the state with what caused them."""
        self._due = 0
        """Tick of the next robot state."""
        self._safety_mode: int | None = None
        """Safety mode last sent to the client, which only gets changes."""

    def opened(self) -> None:
        """Send the version; the first robot state follows with the next tick."""
        self._send(
            messages.version(version.MAJOR, version.MINOR, version.BUGFIX, version.BUILD, version.DATE)
        )

    def receive(self, data: bytes) -> None:
        """Take a piece of a script."""
        for unit in self._intake.feed(data):
            if self._read_only:
                self._orders.decline(unit)
            else:
                self._orders.carry_out(unit)

    def _tell(self, message: bytes) -> None:
        if self.informed:
            self._send(message)

    def sample(self, snapshot: Snapshot) -> bytes:
        """Return the robot state ten times a second, and at once when the safety mode changes.

        A client that reacts to an error code at once then knows the state that it belongs to.
        """
        mode = snapshot.safety_mode
        if mode != self._safety_mode:
            if self._safety_mode is not None:
                self._tell(messages.safety_mode(messages.stamp(snapshot), mode))
                self._send(robot_state(self._robot.description, snapshot))
            self._safety_mode = mode
        for error in self._errors:
            self._tell(error)
        self._errors.clear()
        tick = snapshot.state.tick
        if tick < self._due:
            return b""
        first, self._due = self._due == 0, (tick // EVERY + 1) * EVERY
        state = robot_state(self._robot.description, snapshot)
        if not first:
            return state
        self._send(state)  # the client waits for it, so it must not be dropped
        return b""

    def closed(self) -> None:
        """Report what the client leaves unfinished, and carry out what it has finished."""
        self._orders.leave(self._intake.unfinished)

    @property
    def waiting(self) -> int:
        """Number of units of its text that wait to be carried out."""
        return self._orders.waiting

    def event(self, event: Event) -> None:
        """Send a protective stop as an error, and other safety stops and warnings as lines of the log.

        What programs tell is sent by `Programs`, once to all clients.
        """
        stamp = messages.stamp(self._robot.latest)
        why = event.why or ""
        if event.kind == "protective_stop":
            self._errors.append(
                messages.error_code(stamp, messages.PROTECTIVE_STOP, 0, ErrorLevel.WARNING, why)
            )
        elif event.kind == "safety_stop" or (event.kind == "warning" and event.line is None):
            self._tell(messages.text(stamp, why))

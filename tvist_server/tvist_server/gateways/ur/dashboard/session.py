"""One client of the dashboard."""

from collections import deque
from collections.abc import Callable
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.modes import RuntimeState
from tvist_server.gateways.ur.base import ControllerAccess, PortSession, Send
from tvist_server.gateways.ur.dashboard.commands import QUIT, Request, find
from tvist_server.gateways.ur.dashboard.lines import Lines
from tvist_server.gateways.ur.robot import UrRobot

GREETING: Final = "Connected: Universal Robots Dashboard Server"
MAX_WAITING: Final = 1000
"""Number of lines that may wait for the answer to an earlier one."""
TOO_MANY: Final = f"could not understand: more than {MAX_WAITING} commands wait to be carried out"
PATIENCE: Final = 2500
"""Ticks within which a stopped arm has to come to rest."""
ECHO: Final = 200
"""Characters of an unknown line that the answer repeats."""


class DashboardSession(PortSession):
    """Carries out a client's commands one after the other: the next begins when the previous one was answered.

    Args:
        robot: The robot.
        control: Access to its controller.
        send: Sends data to the client.
    """

    client_begins = True

    def __init__(self, robot: UrRobot, control: ControllerAccess, send: Send) -> None:
        self._robot = robot
        self._control = control
        self._send = send
        self._lines = Lines()
        self._waiting: deque[str] = deque()
        self._declined = 0
        """Number of further lines, which exceeded the limit."""
        self._asked = 0
        """Number of commands begun."""
        self._answered = 0
        """Number of commands answered."""
        self._working = False
        self._rested: Callable[[bool], None] | None = None
        """Function to call when the arm rests."""
        self._last = 0
        """Tick at which waiting for rest ends."""

    def opened(self) -> None:
        self._say(GREETING)

    def receive(self, data: bytes) -> None:
        """Carry out the commands that are complete with these bytes; those beyond MAX_WAITING are declined."""
        if self.over:
            return
        for line in self._lines.feed(data):
            if line.lower() == "stop" and (self._waiting or self._asked > self._answered):
                self._robot.programs.stop(self._control, lambda _: None)  # now, and again in its turn
            if self._declined or len(self._waiting) >= MAX_WAITING:
                self._declined += 1
            else:
                self._waiting.append(line)
            self._work()

    def sample(self, snapshot: Snapshot) -> bytes:
        """Continue a command that waited for the arm to rest."""
        rested = self._rested
        if rested is not None:
            still = snapshot.runtime_state == RuntimeState.STOPPED
            if still or snapshot.state.tick >= self._last:
                self._rested = None
                rested(still)
        return b""

    def closed(self) -> None:
        self.over, self._rested = True, None

    def _work(self) -> None:
        """Carry out the waiting commands, until one has to wait for its answer."""
        if self._working:
            return
        self._working = True
        while self._asked == self._answered and not self.over:
            if self._waiting:
                self._do(self._waiting.popleft())
            elif self._declined:
                # Answered last, since these lines came after those that waited, and answers keep the order.
                self._declined -= 1
                self._say(TOO_MANY)
            else:
                break
        self._working = False

    def _do(self, line: str) -> None:
        self._asked += 1
        number = self._asked

        def answer(text: str) -> None:
            if number == self._answered + 1 and not self.over:
                self._answered = number
                self._say(text)
                self.over = found is not None and found[0].keyword == QUIT
                self._work()

        found = find(line)
        if found is None:
            answer(f"could not understand: '{line[:ECHO]}'")
        else:
            command, argument = found
            keyword = command.keyword
            command.carry_out(Request(self._robot, self._control, keyword, argument, answer, self._at_rest))

    def _at_rest(self, then: Callable[[bool], None]) -> None:
        """Call a function at rest, see `AtRest`, so that a stopped program can be played once its stop is answered."""
        latest = self._robot.latest
        if latest is None or latest.runtime_state == RuntimeState.STOPPED:
            then(True)
        else:
            self._rested, self._last = then, latest.state.tick + PATIENCE

    def _say(self, text: str) -> None:
        plain = "".join([letter if letter.isprintable() else "?" for letter in text])
        self._send(plain.encode() + b"\n")

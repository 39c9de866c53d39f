"""Gateways, through which clients reach a robot, and their interface to the robot."""

from collections.abc import Callable, Collection
from functools import partial
from typing import cast, get_args

from tvist_controller.instruments.report import Report, Topic
from tvist_protocol.channels import tag
from tvist_protocol.codec import encode
from tvist_protocol.commands import Command
from tvist_protocol.errors import TvistError
from tvist_protocol.io import Io
from tvist_protocol.replies import Refused, Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth

Message = State | Event | Truth | Telemetry | Io
Answer = Callable[[Reply], None]  # takes the reply to a command; called once, from any thread
Tell = Callable[[int, int], None]  # takes the number of compiled kernels and of all kernels
Prepare = Callable[[Tell], None]  # does the slow work that precedes the creation of robots


def topic_of(message: Message) -> Topic:
    """Return the topic of a message, which follows from its type."""
    return cast("Topic", tag(type(message)))


class GatewayError(TvistError):
    """A gateway cannot open; the message gives the reason and the remedy."""


class CommandIntake:
    """Takes messages from gateways, in any thread, without blocking; by default ignores unanswered kinds."""

    def request(self, data: bytes, answer: Answer) -> None:
        """Take an encoded command; call `answer` once: directly if rejected, else later in another thread."""
        raise NotImplementedError

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        """Answer a request for `info`: call `answer` once, from any thread, with a function that encodes the message.

        Only the answering thread may call that function, since it may read files.
        """
        raise NotImplementedError

    def command(self, command: Command, answer: Answer, origin: str | None = None) -> None:
        """Take a command that the gateway makes for the machine with IP address `origin` (None: unknown)."""
        raise NotImplementedError

    def setpoint(self, data: bytes) -> None:
        """Take an encoded set-point."""

    def client_seen(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token appeared; `session` declared it, if the token names one."""

    def client_gone(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token, or the session that declared it, has disappeared."""

    def session_gone(self, session: str) -> None:
        """Note that a session has ended, even if other sessions hold tokens of the same clients."""

    def holder(self) -> str | None:
        """Return the client that has control; None: no client."""
        return None


class Starting(CommandIntake):
    """Intake of robots that are still starting: refuses every query with the progress of the start."""

    def __init__(self) -> None:
        self._how_far = ""

    def note(self, done: int, total: int) -> None:
        self._how_far = f"{done} of {total} kernels are compiled; "

    def request(self, data: bytes, answer: Answer) -> None:  # noqa: ARG002  whatever it is
        answer(self._refused())

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        answer(partial(encode, self._refused()))

    def _refused(self) -> Refused:
        return Refused(code="starting", where="", why=f"the robot is starting: {self._how_far}try again")


class Gateway:
    """A way for clients to reach a robot and for the robot's messages to reach them; by default does nothing."""

    setpoints_refused = 0
    """Number of set-points rejected before the intake: on a key with a wildcard, or too large."""
    dropped = 0  # number of states dropped because too many were queued
    wanted_topics: Collection[Topic] = frozenset(get_args(Topic))
    """Topics with a reader. The robot makes no messages that no gateway wants. Any thread may read this."""

    def report(self, report: Report) -> None:
        self.publish("state", report.state, report.encoded)

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:
        """Publish a message, given both decoded and encoded. Called from one thread; network errors raise nothing."""

    async def open(self) -> None:
        """Admit clients; called once the robot ticks."""

    async def shut(self) -> None:
        """Admit no more clients, and disconnect the present ones."""

    def close(self) -> None:
        """Stop listening. Messages that arrive from now on are not answered; a second call does nothing."""

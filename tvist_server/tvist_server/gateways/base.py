"""Gateways, through which clients reach a robot, and the interface between a gateway and its robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from typing import Protocol, cast, get_args

from tvist_controller.instruments.report import Report, Topic
from tvist_protocol.channels import tag
from tvist_protocol.commands import Command
from tvist_protocol.io import Io
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event, State, Telemetry, Truth

Message = State | Event | Truth | Telemetry | Io
Answer = Callable[[Reply], None]
"""Takes the reply to a command, once, from any thread."""


def topic_of(message: Message) -> Topic:
    """Return the topic on which a message is published, which its type names."""
    return cast("Topic", tag(type(message)))


class GatewayError(Exception):
    """A gateway cannot open; the message says why and what to do."""


class Queried(Protocol):
    """Answers the queries that arrive at a gateway. Its methods may be called from any thread and do not block."""

    def request(self, data: bytes, answer: Answer) -> None:
        """Take an encoded command; `answer` is called once: immediately if it is rejected, else from another thread."""

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        """Answer a request for `info`; `answer` is called once, from any thread, with what makes the encoded message.

        Only the thread that answers may call that, since it may read files.
        """


class Desk(Queried, Protocol):
    """Receives all messages that arrive at a gateway, as `Queried` does."""

    def command(self, command: Command, answer: Answer, origin: str | None = None) -> None:
        """Take a command that the gateway made itself.

        Args:
            command: The command.
            answer: As for `request`.
            origin: IP address of the machine on whose behalf it was made, if known.
        """

    def setpoint(self, data: bytes) -> None:
        """Take an encoded set-point."""

    def client_seen(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token has appeared.

        Args:
            client: Name of the client.
            session: Session that declared the token; empty if the token does not name it.
        """

    def client_gone(self, client: str, session: str = "") -> None:
        """Note that a client's liveliness token, or the session that declared it, has disappeared."""

    def session_gone(self, session: str) -> None:
        """Note that a session has ended, even if other sessions hold liveliness tokens of the same clients."""

    def holder(self) -> str | None:
        """Client that has control; None if no client has it."""


class Gateway(ABC):
    """One way for clients to reach a robot, and for the robot's messages to reach them."""

    setpoints_refused: int
    """Number of set-points rejected before the desk: those on a key with a wildcard, and those that are too large."""
    dropped = 0
    """Number of states dropped because too many were waiting."""
    takes: Collection[Topic] = frozenset(get_args(Topic))
    """Topics of which somebody wants messages at present; what no gateway takes is not made. Read from any thread."""

    def report(self, report: Report) -> None:
        """Publish the state of a tick; see `publish`."""
        self.publish("state", report.state, report.encoded)

    @abstractmethod
    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:
        """Publish a message, given both decoded and encoded. Called from one thread; network errors raise nothing."""

    async def open(self) -> None:  # noqa: B027  not every gateway has to wait for something
        """Let clients in. Called when the robot ticks."""

    async def shut(self) -> None:  # noqa: B027  likewise
        """Let no more clients in, and disconnect the present ones."""

    @abstractmethod
    def close(self) -> None:
        """Stop listening. Messages that arrive from now on are not answered; a second call does nothing."""

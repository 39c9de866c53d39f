"""Reception of a robot's messages, in threads of the network."""

import threading
from collections.abc import Callable
from typing import Protocol

from tvist_controller.admission import Admitted, admit, admit_command, admit_setpoint
from tvist_controller.host import Host
from tvist_controller.presence import Presence
from tvist_controller.session import NoControlError
from tvist_protocol.commands import Command, HandOver, TakeClock, TakeControl
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.base import Answer, Desk


class Post(Protocol):
    """Has something done in the controller's thread, before its next tick. From any thread; never waits."""

    def __call__(self, do: Callable[[], None], client: str | None = None, /) -> None:
        """Take what is to be done, and who sent it, where that is known."""


CarryOut = Callable[[Admitted, Answer], None]
"""Has a command carried out in the controller's thread, and answered there. From any thread; never waits."""


class Reception(Desk):
    """The desk of one robot: admits what arrives, and turns away the rest at once, which costs the controller nothing.

    Args:
        host: The controller; of what it does in its thread nothing is called here.
        post: Into the controller's thread.
        carry_out: Takes commands that were admitted.
        hand_on: Takes calls that answer clients, in the controller's thread.
    """

    def __init__(
        self, host: Host, post: Post, carry_out: CarryOut, hand_on: Callable[[Callable[[], None]], None]
    ) -> None:
        self._host, self._post, self._carry_out, self._hand_on = host, post, carry_out, hand_on
        self._lock = threading.Lock()
        self._presence = Presence()
        self.commands_refused = 0
        """Commands that were turned away."""
        self.setpoints_refused = 0
        """Set-points that were."""

    def request(self, data: bytes, answer: Answer) -> None:
        """Take an encoded command; the reply comes from another thread, or at once where it is turned away."""
        standing = self._host.standing
        self._hand_in(admit(data, standing.lease, standing.clock), answer)

    def command(self, command: Command, answer: Answer) -> None:
        """Take a command; `answer` as for `request`."""
        standing = self._host.standing
        self._hand_in(admit_command(command, standing.lease, standing.clock), answer)

    def info(self, answer: Callable[[bytes], None]) -> None:
        """Say what the robot is."""

        def tell() -> None:
            data = self._host.info()
            self._hand_on(lambda: answer(data))

        self._post(tell)

    def holder(self) -> str | None:
        """Client that has control; None: nobody."""
        lease = self._host.standing.lease
        return None if lease is None else lease.client

    def setpoint(self, data: bytes) -> None:
        """Admit a set-point."""
        lease = self._host.standing.lease
        setpoint = admit_setpoint(data, lease)
        if setpoint is None or lease is None:
            with self._lock:
                self.setpoints_refused += 1
        else:
            self._post(lambda: self._host.receive_setpoint(setpoint), lease.client)

    def client_seen(self, client: str, session: str = "") -> None:
        """A client's liveliness token is there."""
        with self._lock:
            self._presence.seen(client, session)

    def client_gone(self, client: str, session: str = "") -> None:
        """A client's liveliness token is gone, or its session."""
        with self._lock:
            self._presence.gone(client, session)
        if self._host.standing.sessions_of(client):  # what is being given to it now: see _unless_gone
            self._post(lambda: self._host.client_gone(client, session))

    def session_gone(self, session: str) -> None:
        """A session has ended, whoever else holds its clients' liveliness tokens."""
        with self._lock:
            clients = self._presence.clients_of(session)
        for client in clients:
            self.client_gone(client, session)

    def _hand_in(self, admitted: Admitted | Refused, answer: Answer) -> None:
        def hand_on(reply: Reply) -> None:
            self._hand_on(lambda: answer(reply))

        answered: Answer = hand_on
        if isinstance(admitted, Admitted) and isinstance(
            admitted.command, TakeControl | HandOver | TakeClock
        ):
            client = admitted.command.client
            admitted, answered = self._with_session(admitted, client), self._unless_gone(client, hand_on)
        if isinstance(admitted, Refused):
            with self._lock:
                self.commands_refused += 1
            answer(admitted)
        else:
            self._carry_out(admitted, answered)

    def _with_session(self, admitted: Admitted, client: str) -> Admitted | Refused:
        try:
            with self._lock:
                return admitted._replace(session=self._presence.session_of(client))
        except NoControlError as error:
            return error.reply

    def _unless_gone(self, client: str, answer: Answer) -> Answer:
        """Answer a command that gives a client control or the clock, and take it back where the client has gone."""

        def answered(reply: Reply) -> None:
            for session in self._host.standing.sessions_of(client):
                if session is None:
                    continue
                with self._lock:
                    there = self._presence.has(client, session)
                if not there:
                    self._host.client_gone(client, session)
            answer(reply)

        return answered

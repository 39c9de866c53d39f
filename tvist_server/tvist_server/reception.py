"""Where a robot's messages arrive, in threads of the network's."""

import threading
from collections.abc import Callable
from typing import Protocol

from tvist_protocol.codec import encode
from tvist_protocol.commands import HandOver, TakeClock, TakeControl
from tvist_protocol.replies import Refused
from tvist_server.admission import Admitted, admit, admit_setpoint
from tvist_server.gateways.base import Reply
from tvist_server.host import Host
from tvist_server.presence import Presence
from tvist_server.session import NoControlError


class Post(Protocol):
    """Has something done in the controller's thread, before its next tick. From any thread; never waits."""

    def __call__(self, do: Callable[[], None], client: str | None = None, /) -> None:
        """Take what is to be done, and who sent it, where that is known."""


CarryOut = Callable[[Admitted, Reply], None]
"""Has a command carried out in the controller's thread, and answered there. From any thread; never waits."""


class Reception:
    """Admits what arrives, and turns away the rest at once: that costs the controller nothing.

    Args:
        host: The controller; of what it does in its thread nothing is called here.
        post: Into the controller's thread.
        carry_out: Takes commands that were admitted.
    """

    def __init__(self, host: Host, post: Post, carry_out: CarryOut) -> None:
        self._host, self._post, self._carry_out = host, post, carry_out
        self._lock = threading.Lock()
        self._presence = Presence()
        self.commands_refused = 0
        """Commands that were turned away."""
        self.setpoints_refused = 0
        """Set-points that were."""

    def request(self, data: bytes, turn_away: Reply, answer: Reply) -> None:
        """Admit a command.

        Args:
            data: The message.
            turn_away: Takes the reply to one that is not admitted.
            answer: Takes the reply to one that is, in the controller's thread.
        """
        standing = self._host.standing
        admitted = admit(data, standing.lease, standing.clock)
        if isinstance(admitted, Admitted) and isinstance(
            admitted.command, TakeControl | HandOver | TakeClock
        ):
            client = admitted.command.client
            admitted, answer = self._with_session(admitted, client), self._unless_gone(client, answer)
        if isinstance(admitted, Refused):
            with self._lock:
                self.commands_refused += 1
            turn_away(encode(admitted))
        else:
            self._carry_out(admitted, answer)

    def setpoint(self, data: bytes) -> None:
        """Admit a set-point."""
        lease = self._host.standing.lease
        setpoint = admit_setpoint(data, lease)
        if setpoint is None or lease is None:
            with self._lock:
                self.setpoints_refused += 1
        else:
            self._post(lambda: self._host.receive_setpoint(setpoint), lease.client)

    def client_seen(self, client: str, session: str) -> None:
        """A client's liveliness token is there."""
        with self._lock:
            self._presence.seen(client, session)

    def client_gone(self, client: str, session: str) -> None:
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

    def _with_session(self, admitted: Admitted, client: str) -> Admitted | Refused:
        try:
            with self._lock:
                return admitted._replace(session=self._presence.session_of(client))
        except NoControlError as error:
            return error.reply

    def _unless_gone(self, client: str, answer: Reply) -> Reply:
        """Answer a command that gives a client control or the clock, and take it back where the client has gone."""

        def answered(data: bytes) -> None:
            for session in self._host.standing.sessions_of(client):
                if session is None:
                    continue
                with self._lock:
                    there = self._presence.has(client, session)
                if not there:
                    self._host.client_gone(client, session)
            answer(data)

        return answered

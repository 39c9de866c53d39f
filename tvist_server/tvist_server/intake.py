"""Receives a robot's messages in the network's threads."""

import threading
from collections.abc import Callable
from functools import partial

from tvist_controller.dispatch.admission import Admitted, admit, admit_command, admit_setpoint
from tvist_controller.dispatch.rights import Presence
from tvist_controller.host import Host
from tvist_controller.refusal import RefusalError
from tvist_protocol.commands import Command, HandOver, TakeClock, TakeControl
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.base import Answer, CommandIntake


class RobotIntake(CommandIntake):
    """Checks messages to one robot: passes valid ones on, rejects others at once without the controller."""

    def __init__(
        self,
        host: Host,  # only its thread-safe methods are called here
        post: Callable[..., None],  # queues a job (and its client, if known) for the next tick
        carry_out: Callable[[Admitted, Answer], None],  # queues a command, which is answered when it is done
        complete_info: Callable[[bytes], bytes] = bytes,  # adds the server's part to an encoded `info`
    ) -> None:
        self._host, self._post, self._carry_out = host, post, carry_out
        self._complete_info = complete_info
        self._lock = threading.Lock()
        self._presence = Presence()
        self.commands_refused = 0
        self.setpoints_refused = 0

    def request(self, data: bytes, answer: Answer) -> None:
        # No lock is needed: the controller replaces `standing` as a whole. A lease may end before the
        # command's turn, so the tick thread checks it again.
        standing = self._host.standing
        self._hand_in(admit(data, standing.lease, standing.clock), answer)

    def command(self, command: Command, answer: Answer, origin: str | None = None) -> None:
        standing = self._host.standing
        admitted = admit_command(command, standing.lease, standing.clock)
        self._hand_in(admitted if isinstance(admitted, Refused) else admitted._replace(origin=origin), answer)

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        def tell() -> None:
            answer(partial(self._complete_info, self._host.info()))

        self._post(tell)

    def holder(self) -> str | None:
        lease = self._host.standing.lease
        return None if lease is None else lease.client

    def setpoint(self, data: bytes) -> None:
        """Pass a set-point on; without a valid lease, count and drop it, since set-points are not answered."""
        lease = self._host.standing.lease
        setpoint = admit_setpoint(data, lease)
        if setpoint is None or lease is None:
            with self._lock:
                self.setpoints_refused += 1
        else:
            self._post(lambda: self._host.receive_setpoint(setpoint), lease.client)

    def client_seen(self, client: str, session: str = "") -> None:
        with self._lock:
            self._presence.seen(client, session)

    def client_gone(self, client: str, session: str = "") -> None:
        with self._lock:
            self._presence.gone(client, session)
        if self._host.standing.sessions_of(client):  # `_unless_gone` handles a grant in progress
            self._post(lambda: self._host.client_gone(client, session))

    def session_gone(self, session: str) -> None:
        with self._lock:
            clients = self._presence.clients_of(session)
        for client in clients:
            self.client_gone(client, session)

    def _hand_in(self, admitted: Admitted | Refused, answer: Answer) -> None:
        if isinstance(admitted, Admitted) and isinstance(
            admitted.command, TakeControl | HandOver | TakeClock
        ):
            client = admitted.command.client
            try:
                with self._lock:
                    admitted = admitted._replace(session=self._presence.session_of(client))
                answer = self._unless_gone(client, answer)
            except RefusalError as error:
                admitted = error.reply
        if isinstance(admitted, Refused):
            with self._lock:
                self.commands_refused += 1
            answer(admitted)
        else:
            self._carry_out(admitted, answer)

    def _unless_gone(self, client: str, answer: Answer) -> Answer:
        """Return `answer` for a grant of control or the clock; it revokes the grant if the client is gone."""

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

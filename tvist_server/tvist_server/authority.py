"""Who has control, and what ends with it: the commands of the lease."""

from collections.abc import Callable

from tvist_protocol.commands import HandOver, KeepAlive, ReleaseControl, TakeControl
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.values import PROTOCOL_VERSION
from tvist_server.command_row import Call, Row
from tvist_server.events import Emit
from tvist_server.refusal import RefusalError
from tvist_server.session import Session


class Authority:
    """Gives, renews and ends the lease. Motion ends with it.

    Args:
        session: The lease.
        interrupt: Ends motion; it takes the reason.
        emit: Takes what happens.
    """

    def __init__(self, session: Session, interrupt: Callable[[str], None], emit: Emit) -> None:
        self.session = session
        self._interrupt, self._emit = interrupt, emit
        self.rows = (
            Row(TakeControl, self._take, needs_lease=False),
            Row(KeepAlive, lambda _: None),  # every command renews the lease
            Row(HandOver, self._hand_over),
            Row(ReleaseControl, self._release),
        )

    def watch(self, now: float) -> None:
        """End a lease that nobody has renewed."""
        if self.session.expired(now):
            self._lose("the lease ran out: no command renewed it")

    def client_gone(self, client: str, session: str) -> None:
        """A client's session has ended; where it held control, motion ends with it."""
        if self.session.client_gone(client, session):
            self._lose(f"client {client!r} is gone")

    def _lose(self, why: str) -> None:
        self.session.release()
        self._emit("lease_lost", why=why)
        self._interrupt(why)

    def _take(self, call: Call[TakeControl]) -> Reply:
        command = call.command
        if command.protocol != PROTOCOL_VERSION:
            raise RefusalError(
                "unsupported_version", "protocol",
                f"protocol is {command.protocol}; this server speaks {PROTOCOL_VERSION}", PROTOCOL_VERSION,
            )  # fmt: skip
        lease = self.session.take(command.client, command.lease_s, call.now, call.session)
        return Accepted(token=lease.token, lease_s=lease.seconds)

    def _hand_over(self, call: Call[HandOver]) -> None:
        """Give the lease to another client, who then takes control and gets a token of its own."""
        self.session.hand_over(call.command.client, call.now, call.session)

    def _release(self, _: Call[ReleaseControl]) -> None:
        self.session.release()
        self._interrupt("control was released")

"""Control for clients without leases: a host gets control with its first command that changes something.

All connections of a host share the lease, because a client opens several: one for commands, one for inputs, one to
listen. Control is given back when the last connection that used it is closed.
"""

from collections.abc import Callable

from tvist_protocol.commands import Command, KeepAlive, ReleaseControl, TakeControl
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_server.gateways.base import Desk
from tvist_server.gateways.ur.base import ControllerAccess, Then

# The longest that the protocol allows, since the control of a host ends with its connections and not with time
# (decision 12). ALIVE is wall time, the lease robot's time, which may pass many times faster in lockstep.
LEASE = 3600.0
"""Duration of the lease without renewal [s]; it is renewed every `ALIVE`."""
ALIVE = 10.0
"""Time between two renewals of the lease [s]."""
_LOST = {"no_control", "stale_token"}
_NO_TOKEN = ""

Soon = Callable[[Callable[[], None]], None]
"""Schedules a call in the interfaces' thread; may be called from any thread."""


class HostLease:
    """Control for the clients of one host.

    Args:
        desk: The robot.
        host: Address of the host.
        soon: Schedules a call in the interfaces' thread.
    """

    def __init__(self, desk: Desk, host: str, soon: Soon) -> None:
        self.client = f"ur-{host}"
        """Name under which the lease is held."""
        self._desk, self.host = desk, host
        self._soon = soon
        self._token = _NO_TOKEN
        self._waiting: list[tuple[Callable[[str], Command], Then]] = []
        self._taking = False
        self._users: set[object] = set()

    def change(self, connection: object, command: Callable[[str], Command], then: Then) -> None:
        """Send a command that needs control, on behalf of a connection."""
        self._users.add(connection)
        if self._token == _NO_TOKEN:
            self._wait(command, then)
            return

        def again(reply: Reply) -> None:
            # The lease has been lost since, through another client's power command or a reset. Control may be free
            # again.
            if isinstance(reply, Refused) and reply.code in _LOST and reply.where == "token":
                self._token = _NO_TOKEN
                self._wait(command, then)
            else:
                then(reply)

        self.ask(command(self._token), again)

    def ask(self, command: Command, then: Then) -> None:
        """Send a command as it is; it needs no control, or has its token already."""
        self._desk.command(command, lambda reply: self._soon(lambda: then(reply)), self.host)

    def leave(self, connection: object) -> None:
        """Note that a connection is closed; give back control if it was the last one that used it."""
        self._users.discard(connection)
        if not self._users and self._token != _NO_TOKEN:
            self.ask(ReleaseControl(token=self._token), self._gone)
            self._token = _NO_TOKEN

    def _gone(self, _: Reply) -> None:
        """After control was given back, report the client as gone, unless a connection has begun to use it again."""
        if not self._users:
            self._desk.client_gone(self.client)

    def adopt(self, token: str, holder: object) -> None:
        """Act with control that this host holds already, and do not give it back.

        Args:
            token: Token of the lease.
            holder: Who holds it for the host.
        """
        self._token = token
        self._users.add(holder)

    def keep_alive(self) -> None:
        """Renew the lease, if there is one."""
        if self._token != _NO_TOKEN:
            self.ask(KeepAlive(token=self._token), _nothing)

    @property
    def held_by_other(self) -> bool:
        """Whether another client has control."""
        return self._desk.holder() not in {None, self.client}

    def _wait(self, command: Callable[[str], Command], then: Then) -> None:
        """Send a command as soon as the host has control."""
        self._waiting.append((command, then))
        if not self._taking:
            self._taking = True
            self._desk.client_seen(self.client)
            self.ask(TakeControl(client=self.client, lease_s=LEASE), self._taken)

    def _taken(self, reply: Reply) -> None:
        self._taking = False
        waiting, self._waiting = self._waiting, []
        if isinstance(reply, Accepted) and reply.token is not None:
            self._token = reply.token
            for command, then in waiting:
                self.ask(command(self._token), then)
            if not self._users:  # all of them have disconnected since
                self.leave(None)
        else:
            self._desk.client_gone(self.client)
            for _, then in waiting:
                then(reply)


class ConnectionControl(ControllerAccess):
    """One connection's access to the controller.

    Args:
        lease: Lease of the client's host.
        hear: Called with each answer, as a function to call.
        peer: Name of the client in messages to people; by default its host.
    """

    def __init__(
        self,
        lease: HostLease,
        hear: Callable[[Callable[[], None]], None] | None = None,
        peer: str | None = None,
    ) -> None:
        self.peer, self.host = peer or lease.client, lease.host
        self._lease = lease
        self.hear = hear or _at_once
        """Has an answer handled, which is a function to call."""
        self.unanswered = 0
        """Number of commands that are not yet answered."""

    def change(self, command: Callable[[str], Command], then: Then) -> None:
        self._lease.change(self, command, self._counted(then))

    def ask(self, command: Command, then: Then) -> None:
        self._lease.ask(command, self._counted(then))

    def _counted(self, then: Then) -> Then:
        self.unanswered += 1

        def counted(reply: Reply) -> None:
            self.unanswered -= 1
            self.hear(lambda: then(reply))

        return counted

    @property
    def held_by_other(self) -> bool:
        return self._lease.held_by_other

    def lasting(self) -> "ConnectionControl":
        """Return a further access for the same host, which does not end with the connection."""
        return ConnectionControl(self._lease, self.hear, self.peer)

    def leave(self) -> None:
        """Give back control, when the connection or what outlasted it has ended."""
        self._lease.leave(self)


def _at_once(action: Callable[[], None]) -> None:
    action()


def _nothing(reply: Reply) -> None:
    """Ignore the reply."""

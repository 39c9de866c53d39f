"""Control for clients that know no leases: a host's connections share control until the last one closes."""

from collections.abc import Awaitable, Callable

from tvist_protocol.commands import Command, KeepAlive, ReleaseControl, TakeControl
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_server.gateways.base import CommandIntake
from tvist_server.gateways.ur.deferred import Deferred, begin

# The longest lease that the protocol allows: a host's control ends with its connections, not with time. ALIVE
# is wall time but the lease is robot time, which can pass many times faster in lockstep.
LEASE = 3600.0  # duration of the lease without renewal [s]; it is renewed every `ALIVE`
ALIVE = 10.0  # time between two renewals of the lease [s]
_LOST = {"no_control", "stale_token"}
_NO_TOKEN = ""

MakeCommand = Callable[[str], Command]  # creates a command from the token of the lease


class HostLease:
    """Control for the clients of one host; `soon` runs a function in the interfaces' thread."""

    def __init__(self, intake: CommandIntake, host: str, soon: Callable[[Callable[[], None]], None]) -> None:
        self.client = f"ur-{host}"  # name under which the lease is held
        self._intake, self.host = intake, host
        self._soon = soon
        self._token = _NO_TOKEN
        self._taking: Deferred[Reply] | None = None  # reply to a pending request for control
        self._users: set[object] = set()

    async def change(self, connection: object, command: MakeCommand) -> Reply:
        """Send a command that needs control, on behalf of a connection."""
        self._users.add(connection)
        if self._token != _NO_TOKEN:
            reply = await self.ask(command(self._token))
            if not (isinstance(reply, Refused) and reply.code in _LOST and reply.where == "token"):
                return reply
            # The lease was lost to another client's power command or to a reset; control may be free again.
            self._token = _NO_TOKEN
        taken = await self._take()
        if not isinstance(taken, Accepted) or taken.token is None:
            return taken
        return await self.ask(command(taken.token))

    def ask(self, command: Command) -> Deferred[Reply]:
        """Send a command that needs no control or already has its token."""
        later = Deferred[Reply]()
        self._intake.command(command, lambda reply: self._soon(lambda: later.set(reply)), self.host)
        return later

    def leave(self, connection: object) -> None:
        """Note that a connection is closed; if no other connection uses control, release it."""
        self._users.discard(connection)
        if not self._users and self._token != _NO_TOKEN:
            token, self._token = self._token, _NO_TOKEN
            begin(self._release(token))

    async def _release(self, token: str) -> None:
        """Release control; unless a connection used control again meanwhile, report the client as gone."""
        await self.ask(ReleaseControl(token=token))
        if not self._users:
            self._intake.client_gone(self.client)

    def adopt(self, token: str, holder: object) -> None:
        """Use a lease that another part of the process has taken for this host, and do not release it."""
        self._token = token
        self._users.add(holder)

    def keep_alive(self) -> None:
        if self._token != _NO_TOKEN:
            self.ask(KeepAlive(token=self._token))

    @property
    def held_by_other(self) -> bool:
        return self._intake.holder() not in {None, self.client}

    def _take(self) -> Deferred[Reply]:
        """Take control, once for all connections that need it."""
        taking = self._taking
        if taking is None:
            taking = self._taking = Deferred[Reply]()
            self._intake.client_seen(self.client)
            begin(self._taken(taking))
        return taking

    async def _taken(self, taking: Deferred[Reply]) -> None:
        reply = await self.ask(TakeControl(client=self.client, lease_s=LEASE))
        self._taking = None
        if isinstance(reply, Accepted) and reply.token is not None:
            self._token = reply.token
        else:
            self._intake.client_gone(self.client)
        taking.set(reply)
        if not self._users:  # all its users have disconnected meanwhile
            self.leave(None)


class ConnectionControl:
    """Access of one connection to the controller; `peer` is the client's name in messages."""

    def __init__(
        self,
        lease: HostLease,
        deliver: Callable[[Callable[[], None]], None] = lambda answer: answer(),
        peer: str | None = None,
    ) -> None:
        self.peer, self.host = peer or lease.client, lease.host
        self._lease = lease
        self.deliver = deliver  # calls a function that handles an answer
        self.unanswered = 0  # number of commands without an answer

    def change(self, command: MakeCommand) -> Deferred[Reply]:
        """Send a command that needs control; it is refused if another client has it."""
        return self._delivered(self._lease.change(self, command))

    def ask(self, command: Command) -> Deferred[Reply]:
        return self._delivered(self._lease.ask(command))

    def _delivered(self, reply: Awaitable[Reply]) -> Deferred[Reply]:
        heard = Deferred[Reply]()
        begin(self._wait_for(reply, heard))
        return heard

    async def _wait_for(self, awaited: Awaitable[Reply], heard: Deferred[Reply]) -> None:
        self.unanswered += 1
        reply = await awaited
        self.unanswered -= 1
        self.deliver(lambda: heard.set(reply))

    @property
    def held_by_other(self) -> bool:
        """Whether another client has control, so that commands that change something are refused."""
        return self._lease.held_by_other

    def lasting(self) -> "ConnectionControl":
        """Return another access for the same host, which survives the connection."""
        return ConnectionControl(self._lease, self.deliver, self.peer)

    def leave(self) -> None:
        """Release control, when the connection or its lasting access has ended."""
        self._lease.leave(self)

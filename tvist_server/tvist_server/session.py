"""Who may move the arm: control by lease. It knows no motion, network or clock: the time is an argument."""

from dataclasses import dataclass

from tvist_protocol.replies import Code


@dataclass(frozen=True)
class Lease:
    """Control, held by one client."""

    client: str
    token: str
    seconds: float
    """How long it lasts without a sign of life [s]."""
    ends: float
    """Time at which it is lost without one [s]."""
    watched: bool
    """Whether the client's presence was known when it took control: then its going ends the lease at once."""


class NoControlError(Exception):
    """A command that needs control came without it."""

    def __init__(self, code: Code, why: str) -> None:
        super().__init__(why)
        self.code = code
        self.why = why


class Session:
    """One lease at a time.

    Args:
        timeouts: Whether a lease ends by itself; in lockstep nothing times out.
    """

    def __init__(self, *, timeouts: bool) -> None:
        self._timeouts = timeouts
        self._granted = 0
        self._present: set[str] = set()
        self.lease: Lease | None = None

    def take(self, client: str, seconds: float, now: float) -> Lease:
        """Give control to a client; one that already has it gets a new lease.

        Raises:
            NoControlError: Another client holds it.
        """
        if self.lease is not None and self.lease.client != client:
            why = f"control is held by {self.lease.client!r} until it releases it"
            raise NoControlError("no_control", why)
        self._granted += 1
        self.lease = Lease(
            client=client,
            token=f"{client}#{self._granted}",
            seconds=seconds,
            ends=now + seconds,
            watched=client in self._present,
        )
        return self.lease

    def renew(self, token: str, now: float) -> Lease:
        """Check a token and renew its lease.

        Raises:
            NoControlError: Nobody has control, or the token is another one's or an old one.
        """
        lease = self.lease
        if lease is None:
            raise NoControlError("no_control", "nobody has control: send take_control first")
        if token != lease.token:
            why = f"token is not that of the present lease, held by {lease.client!r}"
            raise NoControlError("stale_token", why)
        self.lease = Lease(lease.client, lease.token, lease.seconds, now + lease.seconds, lease.watched)
        return self.lease

    def hand_over(self, client: str, now: float) -> None:
        """Keep the present lease for another client, from now on: it has only to take it."""
        if self.lease is not None:
            seconds = self.lease.seconds
            self.lease = None
            self.take(client, seconds, now)

    def release(self) -> None:
        """End the lease."""
        self.lease = None

    def expired(self, now: float) -> bool:
        """Whether the lease has run out."""
        return self._timeouts and self.lease is not None and now >= self.lease.ends

    def client_seen(self, client: str) -> None:
        """A client's liveliness token is there."""
        self._present.add(client)

    def client_gone(self, client: str) -> bool:
        """A client's liveliness token is gone; True where that ends the lease."""
        self._present.discard(client)
        return self.lease is not None and self.lease.client == client and self.lease.watched

"""Control of the arm by lease. Motion, network and clock are not involved: the time is an argument."""

import math
from dataclasses import dataclass

from tvist_protocol.replies import Code, Refused


@dataclass(frozen=True)
class Lease:
    """Control that one client holds."""

    client: str
    token: str
    seconds: float
    """Duration without renewal [s]."""
    session: str | None
    """Session whose end ends the lease; empty if the client's token does not name it, None if it had no token."""


class NoControlError(Exception):
    """A command that needs control came from a client without it."""

    def __init__(self, code: Code, why: str, where: str = "token") -> None:
        super().__init__(why)
        self.code = code
        self.why = why
        self.where = where

    @property
    def reply(self) -> Refused:
        """The reply to the command."""
        return Refused(code=self.code, where=self.where, why=self.why)


def check_token(lease: Lease | None, token: str, where: str = "token") -> Lease:
    """Return the lease that a token names.

    Raises:
        NoControlError: No client has control, or the token is another client's or an old one.
    """
    if lease is None:
        raise NoControlError("no_control", "no client has control: send take_control first", where)
    if token != lease.token:
        why = f"{where} is not that of the current lease, held by {lease.client!r}"
        raise NoControlError("stale_token", why, where)
    return lease


def is_holders(lease: Lease | None, token: str | None) -> bool:
    """Return whether a token is that of the client in control."""
    return lease is not None and token == lease.token


def check_free(lease: Lease | None, client: str) -> None:
    """Check that a client may take control.

    Raises:
        NoControlError: Another client has it.
    """
    if lease is not None and lease.client != client:
        why = f"control is held by {lease.client!r}: wait until it releases control or its lease ends"
        raise NoControlError("no_control", why)


class Session:
    """One lease at a time; it ends by itself, but in lockstep nothing times out.

    The instance is part of every token, different after each restart, so that no token of before is valid
    again; empty where equal runs have to give equal tokens.
    """

    def __init__(self, *, timeouts: bool, instance: str = "") -> None:
        self._timeouts = timeouts
        self._prefix = f"{instance}." if instance else ""
        self._granted = 0
        self.lease: Lease | None = None
        self._ends = math.inf

    def take(self, client: str, seconds: float, now: float, session: str | None = None) -> Lease:
        """Give control to a client for so many seconds; one that already has it gets a new lease.

        The end of the session ends the lease; None if its end will not be reported.

        Raises:
            NoControlError: Another client has control.
        """
        check_free(self.lease, client)
        self.lease = self._grant(client, seconds, now, session)
        return self.lease

    def renew(self, token: str, now: float) -> Lease:
        """Check a token and renew its lease.

        Raises:
            NoControlError: See `check_token`.
        """
        lease = check_token(self.lease, token)
        self._ends = now + lease.seconds
        return lease

    def hand_over(self, client: str, now: float, session: str | None = None) -> None:
        """Reserve the lease for another client, which only has to take it; the session is as in `take`."""
        if self.lease is not None:
            self.lease = self._grant(client, self.lease.seconds, now, session)

    def release(self) -> None:
        """End the lease."""
        self.lease = None

    @property
    def ends(self) -> float:
        """Time at which the lease runs out if it is not renewed [s]; infinite if it does not."""
        return self._ends if self._timeouts and self.lease is not None else math.inf

    def expired(self, now: float) -> bool:
        """Return whether the lease has run out."""
        return now >= self.ends

    def client_gone(self, client: str, session: str) -> bool:
        """Handle the end of a client's session; return True if the lease ends with it."""
        return self.lease is not None and (self.lease.client, self.lease.session) == (client, session)

    def _grant(self, client: str, seconds: float, now: float, session: str | None) -> Lease:
        self._granted += 1
        self._ends = now + seconds
        return Lease(client, f"{client}#{self._prefix}{self._granted}", seconds, session)

"""The right to step time in lockstep: the holder of the clock has it; if there is none, the holder of the lease.

Motion, network and clock are not involved.
"""

from dataclasses import dataclass
from typing import NamedTuple

from tvist_controller.authority.session import Lease, NoControlError, check_token
from tvist_protocol.simulation import SimulationStep


@dataclass(frozen=True)
class ClockHold:
    """The hold of one client on the clock."""

    client: str
    token: str
    session: str | None
    """Session whose end ends the hold; empty if the client's token does not name it, None if it had no token."""


def check_clock_token(hold: ClockHold | None, token: str) -> ClockHold:
    """Return the hold of the clock that a token names.

    Raises:
        NoControlError: No client holds the clock, or the token is another client's or an old one.
    """
    if hold is None:
        raise NoControlError("no_control", "no client holds the clock: send take_clock first")
    if token != hold.token:
        raise NoControlError("stale_token", f"token is not that of the clock, held by {hold.client!r}")
    return hold


def check_clock_free(hold: ClockHold | None, client: str) -> None:
    """Check that a client may take the clock.

    Raises:
        NoControlError: Another client has it.
    """
    if hold is not None and hold.client != client:
        raise NoControlError(
            "no_control", f"the clock is held by {hold.client!r} until it releases it", "client"
        )


def may_step(hold: ClockHold | None, lease: Lease | None, token: str) -> bool:
    """Return whether a token may advance time: the clock's token if a client holds the clock, else the lease's."""
    right = lease if hold is None else hold
    return right is not None and right.token == token


def check_step_token(hold: ClockHold | None, lease: Lease | None, token: str) -> str:
    """Return the name of the client whose token it is, if it may advance time.

    Raises:
        NoControlError: It may not.
    """
    if hold is None:
        return check_token(lease, token).client
    if lease is not None and token == lease.token:
        why = f"the clock is held by {hold.client!r}: a client with control cannot step until the clock is released"
        raise NoControlError("no_control", why)
    return check_clock_token(hold, token).client


def check_step(hold: ClockHold | None, lease: Lease | None, step: SimulationStep) -> str:
    """Return the name of the client that steps; advancing time and sending set-points are separate rights.

    Raises:
        NoControlError: A token is missing or does not give the required right.
    """
    client = check_step_token(hold, lease, step.token)
    if step.motion_token is not None:
        check_token(lease, step.motion_token, "motion_token")
    elif step.setpoints and hold is not None:
        why = "motion_token is missing: set-points need control, and the clock's token does not give it"
        raise NoControlError("missing_field", why, "motion_token")
    return client


class ClockLease:
    """One holder of the clock at a time. The hold does not time out, since nothing does when a client advances time."""

    def __init__(self) -> None:
        self._granted = 0
        self.hold: ClockHold | None = None

    def take(self, client: str, session: str | None = None) -> ClockHold:
        """Give the clock to a client; one that already holds it gets a new token.

        The end of the session ends the hold; None if its end will not be reported.

        Raises:
            NoControlError: Another client holds it.
        """
        check_clock_free(self.hold, client)
        self._granted += 1
        # A lease's token has a number in this place, so the two kinds of tokens cannot be confused.
        self.hold = ClockHold(client, f"{client}#clock{self._granted}", session)
        return self.hold

    def release(self, token: str) -> None:
        """Release the clock.

        Raises:
            NoControlError: See `check_clock_token`.
        """
        check_clock_token(self.hold, token)
        self.hold = None

    def client_gone(self, client: str, session: str) -> bool:
        """Handle the end of a client's session; return True if it held the clock, which is then free."""
        if self.hold is None or (self.hold.client, self.hold.session) != (client, session):
            return False
        self.hold = None
        return True


class Standing(NamedTuple):
    """State of a controller between two ticks; a new one replaces it, so that any thread may read it."""

    lease: Lease | None
    """Lease of the client that has control."""
    clock: ClockHold | None
    """Hold of the client that has the clock."""

    def sessions_of(self, client: str) -> set[str | None]:
        """Sessions whose end takes control or the clock from a client; empty if it has neither."""
        rights = (self.lease, self.clock)
        return {right.session for right in rights if right is not None and right.client == client}

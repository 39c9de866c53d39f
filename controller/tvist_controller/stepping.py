"""The right to step time in lockstep: the holder of the clock has it, or else the holder of the lease.

It knows no motion, network or clock.
"""

from dataclasses import dataclass

from tvist_controller.session import Lease, NoControlError, check_token
from tvist_protocol.simulation import SimulationStep


@dataclass(frozen=True)
class ClockHold:
    """The clock, held by one client."""

    client: str
    token: str
    session: str | None
    """Session whose going ends it; empty where the client's token does not say; None where it had none."""


def check_clock_token(hold: ClockHold | None, token: str) -> ClockHold:
    """The hold of the clock that a token names.

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
        NoControlError: Another one has it.
    """
    if hold is not None and hold.client != client:
        raise NoControlError(
            "no_control", f"the clock is held by {hold.client!r} until it releases it", "client"
        )


def may_step(hold: ClockHold | None, lease: Lease | None, token: str) -> bool:
    """Whether a token lets time pass: the clock's where somebody holds it, otherwise the lease's."""
    right = lease if hold is None else hold
    return right is not None and right.token == token


def check_step_token(hold: ClockHold | None, lease: Lease | None, token: str) -> str:
    """Check that a token lets time pass.

    Returns:
        Name of the client that it is of.

    Raises:
        NoControlError: It does not.
    """
    if hold is None:
        return check_token(lease, token).client
    if lease is not None and token == lease.token:
        why = f"the clock is held by {hold.client!r}: a client with control cannot step until the clock is released"
        raise NoControlError("no_control", why)
    return check_clock_token(hold, token).client


def check_step(hold: ClockHold | None, lease: Lease | None, step: SimulationStep) -> str:
    """Check the tokens of a step: whoever lets time pass need not be who may send set-points.

    Returns:
        Name of the client that steps.

    Raises:
        NoControlError: One of them does not give the right that is needed, or is missing.
    """
    client = check_step_token(hold, lease, step.token)
    if step.motion_token is not None:
        check_token(lease, step.motion_token, "motion_token")
    elif step.setpoints and hold is not None:
        why = "motion_token is missing: set-points need control, and the clock's token does not give it"
        raise NoControlError("missing_field", why, "motion_token")
    return client


class ClockLease:
    """One holder of the clock at a time. Nothing here runs out: where a client lets time pass nothing does."""

    def __init__(self) -> None:
        self._granted = 0
        self.hold: ClockHold | None = None

    def take(self, client: str, session: str | None = None) -> ClockHold:
        """Give the clock to a client; one that already holds it gets a new token.

        Args:
            client: Its name.
            session: Session whose going ends it; None where nothing tells of its going.

        Raises:
            NoControlError: Another client holds it.
        """
        check_clock_free(self.hold, client)
        self._granted += 1
        # A lease's token has a number where this one has a word: neither is ever taken for the other.
        self.hold = ClockHold(client, f"{client}#clock{self._granted}", session)
        return self.hold

    def release(self, token: str) -> None:
        """Give the clock back.

        Raises:
            NoControlError: See `check_clock_token`.
        """
        check_clock_token(self.hold, token)
        self.hold = None

    def client_gone(self, client: str, session: str) -> bool:
        """A client's session has ended; True where it held the clock, which is free then."""
        if self.hold is None or (self.hold.client, self.hold.session) != (client, session):
            return False
        self.hold = None
        return True

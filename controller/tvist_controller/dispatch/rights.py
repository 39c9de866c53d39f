"""Control of the arm by lease, the right to advance time, and presence of clients; time is an argument."""

import math
from collections.abc import Callable
from typing import NamedTuple

from tvist_controller.events import Emit
from tvist_controller.refusal import RefusalError, missing, wrong_mode
from tvist_protocol.simulation import SimulationStep


class Lease(NamedTuple):
    """A client's hold of control or of the clock."""

    client: str
    token: str
    session: str | None
    """Session whose end ends the hold; empty if the client's token names no session, None without a token."""
    seconds: float = math.inf
    """Duration without renewal [s]; infinite for the clock, since nothing times out in simulated time."""


class _Words(NamedTuple):
    """Words in refusals that differ between the two rights: control and the clock."""

    nobody: str
    whose: str
    taken: str
    where: str


CONTROL = _Words(
    "no client has control: send take_control first",
    "the current lease",
    "control is held by {!r}: wait until it releases control or its lease ends",
    "token",
)
CLOCK = _Words(
    "no client holds the clock: send take_clock first",
    "the clock",
    "the clock is held by {!r}: wait until it releases it",
    "client",
)


def check_token(held: Lease | None, token: str, where: str = "token", words: _Words = CONTROL) -> Lease:
    """Return `held` (lease, or hold of the clock with `CLOCK`) if it has this token, else RefusalError."""
    if held is None:
        raise RefusalError("no_control", where, words.nobody)
    if token != held.token:
        why = f"{where} is not that of {words.whose}, held by {held.client!r}"
        raise RefusalError("stale_token", where, why)
    return held


def is_holders(lease: Lease | None, token: str | None) -> bool:
    """Return whether a token is that of the client in control."""
    return lease is not None and token == lease.token


def check_free(held: Lease | None, client: str, words: _Words = CONTROL) -> None:
    """Raise RefusalError if another client has control, or the clock."""
    if held is not None and held.client != client:
        raise RefusalError("no_control", words.where, words.taken.format(held.client))


def may_step(clock: Lease | None, lease: Lease | None, token: str) -> bool:
    """Return whether a token may advance time: the clock's, or the lease's if no client holds the clock."""
    return is_holders(lease if clock is None else clock, token)


def check_step_token(clock: Lease | None, lease: Lease | None, token: str) -> str:
    """Return the client of a token; raise RefusalError if it may not advance time."""
    if clock is None:
        return check_token(lease, token).client
    if is_holders(lease, token):
        why = f"the clock is held by {clock.client!r}: a client with control cannot step until the clock is released"
        raise RefusalError("no_control", "token", why)
    return check_token(clock, token, words=CLOCK).client


def check_step(clock: Lease | None, lease: Lease | None, step: SimulationStep) -> str:
    """Return the client that steps; raise RefusalError if it may not step or send its set-points."""
    client = check_step_token(clock, lease, step.token)
    if step.motion_token is not None:
        check_token(lease, step.motion_token, "motion_token")
    elif step.setpoints and clock is not None:
        raise missing("motion_token", "set-points need control, and the clock's token does not give it")
    return client


class ControlHolders(NamedTuple):
    """Holders of control and the clock at one moment."""

    lease: Lease | None  # lease of the client in control
    clock: Lease | None  # hold of the client with the clock

    def sessions_of(self, client: str) -> set[str | None]:
        """Return the sessions for which a client has control or the clock."""
        return {right.session for right in self if right is not None and right.client == client}


class Authority:
    """Lease and hold of the clock of a robot. A lease's end stops motion; `instance` makes tokens unique."""

    def __init__(
        self,
        interrupt: Callable[[str], None],  # ends motion, for a reason
        emit: Emit,
        *,
        realtime: bool,  # whether time passes by itself: leases time out, and no client may advance time
        instance: str = "",
    ) -> None:
        self._interrupt, self._emit, self._realtime = interrupt, emit, realtime
        self._prefix = f"{instance}." if instance else ""
        self._granted = self._granted_clocks = 0
        self._ends = math.inf
        self.lease: Lease | None = None
        self.clock: Lease | None = None

    def take(self, client: str, seconds: float, now: float, session: str | None = None) -> Lease:
        """Give control to a client for its session (None: unknown), or raise RefusalError if another has it."""
        check_free(self.lease, client)
        return self._grant(client, seconds, now, session)

    def renew(self, token: str, now: float) -> Lease:
        """Renew a token's lease; raise RefusalError as `check_token`."""
        lease = check_token(self.lease, token)
        self._ends = now + lease.seconds
        return lease

    def hand_over(self, client: str, now: float, session: str | None = None) -> None:
        """Reserve the lease for another client, which can then take it; session as in `take`."""
        if self.lease is not None:
            self._grant(client, self.lease.seconds, now, session)

    def _grant(self, client: str, seconds: float, now: float, session: str | None) -> Lease:
        self._granted += 1
        self._ends = now + seconds
        self.lease = lease = Lease(client, f"{client}#{self._prefix}{self._granted}", session, seconds)
        return lease

    @property
    def ends(self) -> float:
        """Time at which the lease expires unless renewed, infinite if never [s]."""
        return self._ends if self._realtime and self.lease is not None else math.inf

    def watch(self, now: float) -> None:
        """End a lease that was not renewed in time."""
        if now >= self.ends:
            self._lose("the lease expired: no command renewed it")

    def end_rights(self, client: str, session: str) -> None:
        """End the rights of a client whose session has ended: control and its motion, and the clock."""
        if self.clock is not None and (self.clock.client, self.clock.session) == (client, session):
            self.clock = None
        if self.lease is not None and (self.lease.client, self.lease.session) == (client, session):
            self._lose(f"client {client!r} is gone")

    def release(self) -> None:
        """End the lease, and the motion, at the holder's request."""
        self.lease = None
        self._interrupt("control was released")

    def _lose(self, why: str) -> None:
        self.lease = None
        self._emit("lease_lost", why=why)
        self._interrupt(why)

    def take_clock(self, client: str, session: str | None = None) -> str:
        """Give the clock to a client and return a new token; raise RefusalError if another holds it."""
        self._check_steppable()
        check_free(self.clock, client, CLOCK)
        self._granted_clocks += 1
        # A lease's token has a number in this place, so the two kinds of tokens cannot be confused.
        self.clock = Lease(client, f"{client}#clock{self._granted_clocks}", session)
        return self.clock.token

    def release_clock(self, token: str) -> None:
        """Release the clock; raise RefusalError as `check_token`."""
        check_token(self.clock, token, words=CLOCK)
        self.clock = None

    def check_step(self, step: SimulationStep, now: float) -> None:
        """Check a step's rights; raise RefusalError without them or in real time."""
        check_step(self.clock, self.lease, step)
        if self.clock is None:
            self.renew(step.token, now)
        self._check_steppable()

    def _check_steppable(self) -> None:
        if self._realtime:
            raise wrong_mode("the robot runs in real time: start it with --clock lockstep to step", "type")


class Presence:
    """Sessions of clients, by client name."""

    def __init__(self) -> None:
        self._sessions: dict[str, set[str]] = {}

    def seen(self, client: str, session: str) -> None:
        """Add a client's liveliness token; the session is empty if the token names none."""
        self._sessions.setdefault(client, set()).add(session)

    def gone(self, client: str, session: str) -> None:
        """Remove a client's liveliness token."""
        there = self._sessions.get(client, set())
        there.discard(session)
        if not there:
            self._sessions.pop(client, None)

    def clients_of(self, session: str) -> list[str]:
        """Return the clients that a session declares."""
        return [client for client, there in self._sessions.items() if session in there]

    def has(self, client: str, session: str) -> bool:
        """Return whether a client's token is present."""
        return session in self._sessions.get(client, ())

    def session_of(self, client: str) -> str | None:
        """Return the session of a client, None without one; raise RefusalError if several sessions use the name."""
        there = self._sessions.get(client, set())
        if len(there) > 1:
            raise RefusalError(
                "no_control",
                "client",
                f"{len(there)} programs are connected as {client!r}, and the server cannot tell which of them sent "
                "this: give each its own name; a program that has lost its connection is forgotten within about 10 s",
            )
        return next(iter(there), None)

"""Control of the robot and of its clock, and the consequences of losing them."""

from collections.abc import Callable

from tvist_controller.authority.session import Session
from tvist_controller.authority.stepping import ClockLease, check_step
from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import RefusalError
from tvist_protocol.simulation import SimulationStep


class Authority(Session):
    """The lease of a robot, with which motion ends, and the right to advance time."""

    def __init__(
        self,
        interrupt: Callable[[str], None],  # ends motion, for a reason
        emit: Emit,
        *,
        realtime: bool,  # whether time passes by itself: leases time out, and no client may advance time
        instance: str = "",  # see `Session`
    ) -> None:
        super().__init__(timeouts=realtime, instance=instance)
        self.stepping = ClockLease()
        self._interrupt, self._emit = interrupt, emit

    def watch(self, now: float) -> None:
        """End a lease that was not renewed in time."""
        if self.expired(now):
            self._lose("the lease expired: no command renewed it")

    def end_rights(self, client: str, session: str) -> None:
        """End the rights of a client whose session has ended: motion ends with control, and the clock becomes free."""
        self.stepping.client_gone(client, session)
        if self.client_gone(client, session):
            self._lose(f"client {client!r} is gone")

    def check_step(self, step: SimulationStep, now: float) -> None:
        """Check that a step's sender may advance time, and may send the set-points in it.

        Raises:
            NoControlError: The sender has no such right.
            RefusalError: Time passes by itself with this clock.
        """
        check_step(self.stepping.hold, self.lease, step)
        if self.stepping.hold is None:
            self.renew(step.token, now)
        self._check_steppable()

    def _check_steppable(self) -> None:
        if self._timeouts:
            why = "the robot runs in real time: start it with --clock lockstep to step"
            raise RefusalError("wrong_mode", "type", why)

    def take_clock(self, client: str, session: str | None) -> str:
        """Give the right to advance time to a client, and return its token."""
        self._check_steppable()
        return self.stepping.take(client, session).token

    def give_up(self) -> None:
        """End the lease, and with it motion, since its holder asks for that."""
        self.release()
        self._interrupt("control was released")

    def _lose(self, why: str) -> None:
        self.release()
        self._emit("lease_lost", why=why)
        self._interrupt(why)

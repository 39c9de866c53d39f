"""Control of the robot and of its clock: the commands for both rights, and the consequences of losing them."""

from collections.abc import Callable
from typing import ClassVar

from tvist_controller.authority.session import Session
from tvist_controller.authority.stepping import ClockLease, check_step
from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import RefusalError
from tvist_controller.planning.command_row import Call, Row
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import HandOver, KeepAlive, ReleaseClock, ReleaseControl, TakeClock, TakeControl
from tvist_protocol.replies import Accepted, Reply
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.values import PROTOCOL_VERSION


def _check_version(command: TakeControl | TakeClock, _: RobotDescription) -> None:
    if command.protocol != PROTOCOL_VERSION:
        why = f"protocol is {command.protocol}; this server speaks {PROTOCOL_VERSION}"
        raise RefusalError("unsupported_version", "protocol", why, PROTOCOL_VERSION)


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

    def _take_clock(self, call: Call[TakeClock]) -> Reply:
        self._check_steppable()
        return Accepted(token=self.stepping.take(call.command.client, call.session).token)

    def _lose(self, why: str) -> None:
        self.release()
        self._emit("lease_lost", why=why)
        self._interrupt(why)

    def _take(self, call: Call[TakeControl]) -> Reply:
        command = call.command
        lease = self.take(command.client, command.lease_s, call.now, call.session)
        return Accepted(token=lease.token, lease_s=lease.seconds)

    def _hand_over(self, call: Call[HandOver]) -> None:
        """Give the lease to another client, which then takes control and gets a token of its own."""
        self.hand_over(call.command.client, call.now, call.session)

    def _release(self, _: Call[ReleaseControl]) -> None:
        self.release()
        self._interrupt("control was released")

    rows: ClassVar[tuple[Row, ...]] = (
        Row(TakeControl, _take, lease="none", check=_check_version),
        Row(KeepAlive, lambda _, __: None),  # every command renews the lease
        Row(HandOver, _hand_over),
        Row(ReleaseControl, _release),
        Row(TakeClock, _take_clock, lease="none", check=_check_version),
        Row(ReleaseClock, lambda self, call: self.stepping.release(call.command.token), lease="none"),
    )

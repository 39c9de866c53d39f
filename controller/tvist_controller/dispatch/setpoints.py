"""Set-points of the client in control, which are not answered."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tvist_controller.authority.session import Session, is_holders
from tvist_controller.commands.counters import Counters
from tvist_controller.commands.refusal import RefusalError, check_joints
from tvist_controller.motion.activity_control import MotionControl
from tvist_protocol.commands import Setpoint
from tvist_protocol.simulation import SimulationStep


class Unreadable(NamedTuple):
    """A set-point that cannot be decoded."""

    token: str | None
    """Token in it, if one is found."""
    why: str
    """A sentence with field, value and limit."""


class Setpoints:
    """Judges set-points: those of the client in control go into the journal, and to the stream if it accepts them.

    All others are counted and dropped.
    """

    def __init__(self, session: Session, motion: MotionControl, counters: Counters) -> None:
        self._session, self._motion, self._counters = session, motion, counters
        self._description = motion.cycle.description

    def receive(
        self, setpoint: Setpoint | Unreadable | None, now: float, note: Callable[[], None] | None = None
    ) -> None:
        """Take a set-point.

        Args:
            setpoint: The set-point; None for one that admission has found to be no holder's.
            now: Time [s].
            note: Notes it in the journal; called before anything changes, if it is the holder's.
        """
        if setpoint is None or not is_holders(self._session.lease, setpoint.token):
            self._count_refused()  # another client's: neither the stream nor the journal is concerned
            return
        if note is not None:
            note()
        if isinstance(setpoint, Unreadable):
            self.refuse(setpoint.why)
            return
        try:
            check_joints(setpoint.q, self._description)
        except RefusalError as refusal:
            self.refuse(refusal.reply.why)
            return
        if not self._motion.streaming:
            self.refuse("no stream is running")
            return
        self._counters.setpoints_received += 1
        self._session.renew(setpoint.token, now)
        self._motion.streams.offer(setpoint.sequence, np.array(setpoint.q, dtype=float), now)

    def check(self, command: SimulationStep) -> None:
        """Check the set-points in a step.

        Raises:
            RefusalError: No stream is running, or they are not valid.
        """
        if command.setpoints is not None and not self._motion.streaming:
            raise RefusalError("wrong_mode", "setpoints", "no stream is running: send servo_start first")
        setpoints = command.setpoints or ()
        if len(setpoints) > command.ticks:
            why = f"setpoints has {len(setpoints)} entries; it must have one per tick, and ticks is {command.ticks}"
            raise RefusalError("out_of_range", "setpoints", why, command.ticks)
        for number, setpoint in enumerate(setpoints):
            check_joints(setpoint.q, self._description, f"setpoints[{number}].q")

    def refuse(self, why: str) -> None:
        """Count and drop a set-point of the client in control; if the stream falls silent, its end gives the reason."""
        self._count_refused()
        self._motion.streams.refuse(why)

    def _count_refused(self) -> None:
        self._counters.setpoints_received += 1
        self._counters.setpoints_refused += 1

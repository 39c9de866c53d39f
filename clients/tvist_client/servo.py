"""A stream of set-points."""

from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Self

from tvist_client.command import TICK
from tvist_client.connection import MAX_STEP, Connection, step
from tvist_client.errors import MisuseError, StreamStoppedError
from tvist_client.values import joint_angles
from tvist_protocol import Event, Info, Setpoint, StepSetpoint
from tvist_protocol.codec import encode


class Servo:
    """The stream that `Arm.servo` yields; it numbers and checks set-points, because a robot does not answer them."""

    period: float
    """Time between two set-points [s]."""
    sequence: int
    """Number of the next set-point."""

    def __init__(self, robot: Connection, token: str, period: float, info: Info) -> None:
        self.period = period
        self.sequence = 0
        self._robot, self._token, self._info = robot, token, info
        self._left = False
        self._stopped: Event | None = None

    def __enter__(self) -> Self:
        self._forget = self._robot.on_event(self._on_event)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left = True
        self._forget()

    def set(self, q: Iterable[float]) -> int:
        """Send the next set-point without blocking; call this once per period.

        In real time, 250 ms without a set-point end the stream; this includes the wait for the first one.

        Args:
            q: Set-point, one angle per joint [rad].

        Returns:
            Its number; `state.setpoint_sequence` shows when it was accepted.

        Raises:
            ArgumentError: The number of angles is wrong, or an angle is not finite or outside its joint's range.
            StreamStoppedError: The robot has ended the stream.
            MisuseError: The block of `Arm.servo` has been left.
        """
        self.check()
        setpoint = Setpoint(token=self._token, sequence=self.sequence, q=joint_angles(q, self._info))
        self._robot.put_setpoint(encode(setpoint))
        self.sequence += 1
        return setpoint.sequence

    async def step_through(self, qs: Iterable[Iterable[float]]) -> int:
        """Play set-points in lockstep and free, each for one period, and step time accordingly.

        Args:
            qs: Set-points, one per period, each with one angle per joint [rad].

        Returns:
            The tick at the end of the last set-point; its state has arrived.

        Raises:
            ArgumentError: See `set`; none of the set-points was played.
            MisuseError: Time passes by itself here, or there are no set-points.
            StreamStoppedError: The robot has ended the stream.
        """
        if await self._robot.clock() == "realtime":
            raise MisuseError("this robot runs in real time: call set(q) once per period")
        setpoints = [
            StepSetpoint(sequence=self.sequence + place, q=joint_angles(q, self._info, f"qs[{place}]"))
            for place, q in enumerate(qs)
        ]
        if not setpoints:
            raise MisuseError("there are no set-points to play")
        ticks = max(1, round(self.period / TICK))
        # One step takes one set-point per tick; if the period is longer, each set-point needs its own step.
        together = MAX_STEP if ticks == 1 else 1
        tick = 0
        for first in range(0, len(setpoints), together):
            self.check()
            played: Sequence[StepSetpoint] = setpoints[first : first + together]
            tick = await step(self._robot, self._token, ticks * len(played), played)
            self.sequence += len(played)
        return tick

    def check(self) -> None:
        """Check that the stream is still running.

        Raises:
            StreamStoppedError: The robot has ended it.
            MisuseError: The block of `Arm.servo` has been left.
        """
        if self._stopped is not None:
            raise StreamStoppedError(self._stopped)
        if self._left:
            raise MisuseError("this stream ended with its `async with` block: call `servo` for a new one")

    def _on_event(self, event: Event) -> None:
        if event.kind == "stream_stopped":
            self._stopped = event

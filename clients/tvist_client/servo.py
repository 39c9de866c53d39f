"""A stream of set-points."""

from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

from tvist_client.errors import MisuseError, StreamStoppedError
from tvist_client.values import floats
from tvist_protocol.codec import encode
from tvist_protocol.commands import Setpoint, StepSetpoint
from tvist_protocol.stream import Event

if TYPE_CHECKING:
    from tvist_client.arm import Arm

TICK = 0.002
"""Control period [s]."""
MAX_STEP = 1000
"""Set-points a `simulation.step` may have."""


class Servo:
    """What `Arm.servo` gives. Numbers the set-points from 0.

    Attributes:
        period: Time between two set-points [s].
        sequence: Number of the next set-point.
    """

    def __init__(self, arm: "Arm", period: float) -> None:
        self.period = period
        self.sequence = 0
        self._arm = arm
        self._stopped: Event | None = None

    def __enter__(self) -> Self:
        self._forget = self._arm.robot.on_event(self._on_event)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._forget()

    def set(self, q: Iterable[float]) -> int:
        """Send the next set-point, without waiting for anything: call it once a period.

        In real time the first one counts: 250 ms without one end the stream.

        Args:
            q: Where to be [rad], one a joint.

        Returns:
            Its number; `state.setpoint_sequence` says when it was accepted.

        Raises:
            StreamStoppedError: The robot has ended the stream.
        """
        self.check()
        sequence = self.sequence
        self._arm.robot.put_setpoint(encode(Setpoint(token=self._arm.token, sequence=sequence, q=floats(q))))
        self.sequence += 1
        return sequence

    async def step_through(self, qs: Iterable[Iterable[float]]) -> int:
        """Play set-points in lockstep and free, each for one period, letting that time pass.

        Args:
            qs: Where to be [rad], one entry a period, each one angle a joint.

        Returns:
            The tick of the last one's end; its state has arrived.

        Raises:
            MisuseError: Time passes by itself here, or there are no set-points.
            StreamStoppedError: The robot has ended the stream.
        """
        robot = self._arm.robot
        if await robot.clock() == "realtime":
            raise MisuseError("time passes by itself here: call set(q) once a period")
        setpoints = [
            StepSetpoint(sequence=sequence, q=floats(q)) for sequence, q in enumerate(qs, self.sequence)
        ]
        if not setpoints:
            raise MisuseError("there are no set-points to play")
        ticks = max(1, round(self.period / TICK))
        # The set-points of one step go one a tick: slower ones need a step each.
        together = MAX_STEP if ticks == 1 else 1
        tick = 0
        for first in range(0, len(setpoints), together):
            self.check()
            played: Sequence[StepSetpoint] = setpoints[first : first + together]
            tick = await self._arm.step(ticks * len(played), played)
            self.sequence += len(played)
        return tick

    def check(self) -> None:
        """Find out whether the stream still runs.

        Raises:
            StreamStoppedError: The robot has ended it.
        """
        if self._stopped is not None:
            raise StreamStoppedError(self._stopped)

    def _on_event(self, event: Event) -> None:
        if event.kind == "stream_stopped":
            self._stopped = event

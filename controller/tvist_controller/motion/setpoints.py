"""Set-points of the client in control, which get no reply, and the stream they feed."""

import math
from typing import NamedTuple

import numpy as np

from tvist_controller.refusal import RefusalError, check_joints
from tvist_controller.trajectory import SetpointStream
from tvist_plant.description import RobotDescription
from tvist_protocol.commands import Setpoint

TIMEOUT = 0.25  # time without set-points that stops a stream [s]


class Unreadable(NamedTuple):
    """A set-point that cannot be decoded."""

    token: str | None
    """Token of the set-point, if found."""
    why: str
    """Message with field, value and limit."""


class Setpoints:
    """Feeds one stream at a time and counts for all streams."""

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self.stream: SetpointStream | None = None
        self._heard = 0.0
        self._refused: str | None = None
        """Reason for the latest rejection, reported if no valid set-point follows."""
        self._ended = 0, 0, 0

    def begin(self, stream: SetpointStream, now: float) -> None:
        """Start feeding a stream."""
        self.stream, self._heard, self._refused = stream, now, None

    def take(self, setpoint: Setpoint | Unreadable, now: float) -> bool:
        """Take a set-point of the client in control; return whether the stream accepts it."""
        if isinstance(setpoint, Unreadable):
            self._refused = setpoint.why
            return False
        try:
            check_joints(setpoint.q, self._description)
        except RefusalError as refusal:
            self._refused = refusal.reply.why
            return False
        if self.stream is None:
            return False
        self._heard, self._refused = now, None
        self.stream.offer(setpoint.sequence, np.array(setpoint.q, dtype=float))
        return True

    @property
    def silent_at(self) -> float:
        """Time at which the stream becomes silent without another set-point, infinite without one [s]."""
        # Slightly early because of rounding; `silence` decides.
        return math.inf if self.stream is None else self._heard + TIMEOUT - 1e-6

    def silence(self, now: float) -> str | None:
        """Return a message if set-points have stopped, else None."""
        if self.stream is None or now - self._heard < TIMEOUT:
            return None
        refused = "" if self._refused is None else f"; the last one was refused: {self._refused}"
        return f"no set-point for {TIMEOUT:g} s{refused}"

    def end(self) -> bool:
        """Stop feeding the stream and add its counts; return whether there was one."""
        there, self._ended = self.stream is not None, self.counters()
        self.stream = None
        return there

    def counters(self) -> tuple[int, int, int]:
        """Return counts of late, lost and limited set-points since the start."""
        late, lost, limited = self._ended
        if (stream := self.stream) is None:
            return self._ended
        return late + stream.late, lost + stream.lost, limited + stream.limited

"""Set-points from a client, played out by their sequence numbers."""

from dataclasses import dataclass, replace

import numpy as np

from tvist_server.trajectory.base import Floats, Limits, Trajectory
from tvist_server.trajectory.limiter import Limiter
from tvist_server.trajectory.stop import Stop

LONGEST_RAMP = 0.02
"""Longest time that taking back an acceleration may last, whatever the jerk limit: the arm moves on [s]."""


class SetpointStream(Trajectory):
    """A reference made of a client's set-points.

    At the controller's own rate set-points pass straight through. Slower ones are played one period late, by
    cubic Hermite interpolation between the two neighbours: the slope at each set-point is that of the
    parabola through it and the two before, so it is known when the set-point arrives and velocity never
    steps. One that is late or lost is bridged by that parabola for at most one period; after that the
    reference comes to rest inside the limits until the stream goes on.

    Args:
        q: Where the arm rests, shape (n,) [rad].
        stream_period: Time between set-points, at least a tick [s].
        limits: Of velocity, acceleration and jerk, for every joint.
        period: Tick [s].
    """

    def __init__(self, q: Floats, stream_period: float, limits: Limits, period: float) -> None:
        self._rest = np.array(q, dtype=float)
        self._stride = period / stream_period
        self._direct = self._stride >= 1.0
        self._period, self._stream_period = period, stream_period
        self.limits = replace(limits, jerk=max(limits.jerk, limits.acceleration / LONGEST_RAMP))
        """Of what the reference does where it is not at the set-points."""
        self._limiter = Limiter(self._rest, self.limits, period)
        self._waiting: dict[int, Floats] = {}
        self._nodes: list[_Node] = []
        # Play-out position in sequence numbers: an exact origin, a lead and ticks since.
        self._origin, self._lead, self._ticks = 0, 0.0, 0
        self._pause: Stop | None = None
        self.sequence: int | None = None
        """Newest set-point that reached the reference."""
        self.late = 0
        """Set-points that came too late to be played, or twice."""
        self.lost = 0
        """Sequence numbers that were passed over; a gap counts for no more than `MAX_WAITING`."""
        self.limited = 0
        """Ticks in which the reference could not be where the set-points were."""

    MAX_WAITING = 1000
    """Set-points that may wait for their play-out."""

    def offer(self, sequence: int, q: Floats) -> bool:
        """Take a set-point; False where it comes too late to be played, or the room to wait is full."""
        known = bool(self._nodes) and sequence <= self._nodes[-1].sequence
        if known or sequence in self._waiting or len(self._waiting) >= self.MAX_WAITING:
            self.late += 1
            return False
        self._waiting[sequence] = q
        return True

    def next(self) -> Floats:
        """Reference of the next tick."""
        if self._nodes:
            self._ticks += 1
        elif self._waiting:
            first = min(self._waiting)
            self._play_from(first)
            still = np.zeros_like(self._rest)
            self._nodes = [_Node(first - 1, self._rest, still, still)]
        else:
            return self._rest
        self._admit()
        q, slope = self._evaluate()
        reference = self._limiter.follow(q, slope / self._stream_period)
        self.limited += self._limiter.limited
        return reference

    @property
    def finished(self) -> bool:
        """Never by itself: it is ended from outside."""
        return False

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._limiter.q, self._limiter.qd, self._limiter.qdd

    @property
    def _offset(self) -> float:
        """Play-out position less origin; rounded, so that it meets whole numbers where it should."""
        return round(self._lead + self._ticks * self._stride, 9)

    def _play_from(self, sequence: int) -> None:
        """Put the play-out position where a set-point that has just come belongs."""
        self._origin, self._lead, self._ticks = sequence, 0.0 if self._direct else -1.0, 0

    def _admit(self) -> None:
        """Move set-points whose time has come from waiting to nodes."""
        if self._waiting:
            ahead = max(self._waiting) - self._origin - self._offset
            if ahead < -1.0 or ahead > (2.0 if self._direct else 3.0):
                # A break longer than a period, or a sender ahead of its own clock: the newest wins from here.
                self._play_from(max(self._waiting))
        reach = self._offset + (0.5 if self._direct else 1.0)
        while self._waiting and (first := min(self._waiting)) - self._origin < reach:
            node = _Node.after(self._nodes, first, self._waiting.pop(first))
            self.lost += min(first - self._nodes[-1].sequence - 1, self.MAX_WAITING)
            self._nodes = [*self._nodes[-2:], node]
            self.sequence = first

    def _evaluate(self) -> tuple[Floats, Floats]:
        """Position [rad] and slope [rad per sequence number] of the stream at the play-out position."""
        last = self._nodes[-1]
        ahead = self._offset - (last.sequence - self._origin)
        if ahead > 1.0:
            return self._wait()
        self._pause = None
        if ahead == 0.0:
            return last.q, last.slope
        if ahead > 0.0:
            slope = last.slope + ahead * last.curvature
            return last.q + 0.5 * ahead * (last.slope + slope), slope
        for before, after in zip(self._nodes[-2::-1], self._nodes[:0:-1], strict=True):
            since = self._offset - (before.sequence - self._origin)
            if since >= 0.0:
                return _hermite(since, before, after)
        return self._nodes[0].q, self._nodes[0].slope

    def _wait(self) -> tuple[Floats, Floats]:
        """Come to rest and stay until the stream goes on."""
        if self._pause is None:
            limits = self.limits
            self._pause = Stop(
                *self.state, acceleration=limits.acceleration, jerk=limits.jerk, period=self._period
            )
        return self._pause.next(), self._pause.velocity * self._stream_period


@dataclass(frozen=True)
class _Node:
    """A set-point that has been admitted; derivatives by sequence number."""

    sequence: int
    q: Floats
    slope: Floats
    curvature: Floats

    @classmethod
    def after(cls, nodes: "list[_Node]", sequence: int, q: Floats) -> "_Node":
        """A new set-point, its slope that of the parabola through it and the two before."""
        last = nodes[-1]
        step = sequence - last.sequence
        chord = (q - last.q) / step
        if len(nodes) < 2:
            curvature = 2.0 * (chord - last.slope) / step
        else:
            before = nodes[-2]
            earlier = (last.q - before.q) / (last.sequence - before.sequence)
            curvature = 2.0 * (chord - earlier) / (sequence - before.sequence)
        return cls(sequence, q, chord + 0.5 * curvature * step, curvature)


def _hermite(since: float, before: _Node, after: _Node) -> tuple[Floats, Floats]:
    """Position and slope of the cubic between two set-points, `since` sequence numbers after the first."""
    span = after.sequence - before.sequence
    u, rise = since / span, after.q - before.q
    a, b = span * before.slope - rise, rise - span * after.slope
    q = before.q + u * rise + u * (1.0 - u) * ((1.0 - u) * a + u * b)
    slope = rise + (1.0 - 2.0 * u) * ((1.0 - u) * a + u * b) + u * (1.0 - u) * (b - a)
    return q, slope / span

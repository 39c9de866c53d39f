"""A client's set-points, played in order of sequence numbers."""

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.trajectory.base import Floats, MotionLimits
from tvist_controller.trajectory.guided import LimitedFollower
from tvist_controller.trajectory.limiter import TorqueMargin
from tvist_controller.trajectory.play_out import PlayOut
from tvist_controller.trajectory.stop import JointStop
from tvist_plant.plant import PERIOD

BRIDGED = 2  # largest number of consecutive missing set-points that are extrapolated


class SetpointStream(LimitedFollower):
    """A reference generated from a client's set-points.

    Set-points at the controller's rate pass unchanged. Set-points at a lower rate are control points of a
    cubic B-spline, which keeps their limits. The spline needs two periods and jitter a third, so the
    reference is late by three periods minus a tick, or more if set-points come later or by another clock
    (`PlayOut`). If a set-point is missing when due, a point on the parabola through its neighbours replaces
    it. If no set-points arrive, the reference comes to rest within limits until the stream continues. After a
    gap, or if the sender runs ahead, play-out continues with the newest set-point. The result passes the
    `Limiter`.
    """

    finished = False  # a stream is ended from outside
    MAX_WAITING = 1000  # largest number of set-points waiting for play-out

    def __init__(
        self,
        q: Floats,  # at which the arm is at rest, shape (n,) [rad]
        stream_period: float,  # time between set-points, at least a tick [s]
        limits: MotionLimits,
        *,
        reach: Floats | None = None,  # largest |q| of each joint, shape (n,) [rad]; None for no limit
        torque: TorqueMargin | None = None,  # None for no limit
    ) -> None:
        self._rest, still = np.array(q, dtype=float), np.zeros(len(q))
        reach = np.full(len(q), np.inf) if reach is None else reach
        super().__init__((self._rest, still, still), limits, reach, torque)
        self._ticks = max(round(stream_period / PERIOD, 9), 1.0)
        self._curve, self._look_ahead = (linear, 1) if self._ticks == 1.0 else (cubic, 2)
        self._play_out: PlayOut | None = None
        self._waiting: dict[int, Floats] = {}
        self._heard: list[int] = []
        # The last four points of the curve, which no longer change, and the number of the newest.
        self._points: deque[Floats] = deque([self._rest] * 4, maxlen=4)
        self._head = 0
        # The last three set-points that were received, with their numbers.
        self._real: deque[tuple[int, Floats]] = deque(maxlen=3)
        self._speed = 0.0
        self._pause: JointStop | None = None
        self.sequence: int | None = None
        """Number of the newest accepted set-point, which the reference reaches after the delay."""
        self.late = 0  # number of late or duplicate set-points
        self.lost = 0  # number of skipped sequence numbers; a gap counts at most `MAX_WAITING`
        self.limited = 0  # number of ticks in which limits kept the reference from the set-points

    def offer(self, sequence: int, q: Floats) -> bool:
        """Take a set-point; return False if it is too late or too many are waiting."""
        known = bool(self._real) and sequence <= self._real[-1][0]
        if known or sequence in self._waiting or len(self._waiting) >= self.MAX_WAITING:
            self.late += 1
            return False
        self._waiting[sequence] = q
        self._heard.append(sequence)
        return True

    def next(self) -> Floats:
        """Return the reference of the next tick."""
        if self._play_out is not None:
            self._play_out.advance(self._speed, self._limiter.behind)
        if self._heard:
            self._receive()
        if self._play_out is None:
            return self._rest
        q, qd = self._evaluate(self._play_out)
        reference = self._limiter.follow(q, qd)
        self.limited += self._limiter.limited
        return reference

    def adapt(self, reduced_limits: Callable[[MotionLimits | None], MotionLimits]) -> None:
        """Reduce the limits if the filter requires; see `Trajectory.adapt`."""
        if (limits := reduced_limits(self.limits)) != self.limits:
            self.adopt(limits)

    @property
    def end(self) -> JointStop:
        """Stop within the stream's limits."""
        limits = self.limits
        return JointStop(*self.state, acceleration=limits.acceleration, jerk=limits.jerk)

    @property
    def delay(self) -> float:
        """Time from arrival of set-points that come early until the curve reaches them [s]."""
        return 0.0 if self._play_out is None else self._play_out.delay * PERIOD

    def _receive(self) -> None:
        play_out, newest = self._play_out, max(self._waiting)
        self.sequence = newest
        if play_out is None:
            first = min(self._waiting)
            self._real.extend(((first - 2, self._rest), (first - 1, self._rest)))
            self._head = first - 1
            play_out = self._play_from(first)
        if newest in self._heard and play_out.breaks(newest):
            # After a gap, or if the sender is ahead of its own clock, continue with the newest.
            play_out = self._restart(newest)
        for sequence in self._heard:
            play_out.hear(sequence)
        self._heard.clear()
        if min(self._waiting) <= self._head:
            for sequence in sorted(number for number in self._waiting if number <= self._head):
                # This set-point came too late and was replaced, but later replacements should use it.
                self._keep(sequence, self._waiting.pop(sequence))
                self.late += 1

    def _restart(self, newest: int) -> PlayOut:
        """Continue with the newest set-point, after putting all others that wait on the curve."""
        self._head = self._real[-1][0]
        for sequence in sorted(self._waiting):
            if sequence != newest:
                self._put(sequence)
        self._heard.clear()
        return self._play_from(newest)

    def _play_from(self, sequence: int) -> PlayOut:
        self._play_out = PlayOut(sequence, self._look_ahead, self._ticks, self.limits)
        return self._play_out

    def _evaluate(self, play_out: PlayOut) -> tuple[Floats, Floats]:
        origin, offset = play_out.position
        after = math.ceil(offset)
        if not self._complete(origin + after + self._look_ahead - 1):
            return self._wait()
        self._pause = None
        q, qd, self._speed = self._curve(self._points, offset - after + 1.0, play_out.rate / PERIOD)
        return q, qd

    def _complete(self, needed: int) -> bool:
        """Extend the curve to the sequence number `needed`; return False if there are not enough points."""
        while self._head < needed:
            missing = self._head + 1
            if self._waiting:
                coming = min(self._waiting)
                if coming == missing:
                    self._put(coming)
                else:
                    missing = max(missing, min(coming, needed) - 3)  # earlier ones no longer affect the curve
                    self._make_up(missing, (*self._real, (coming, self._waiting[coming]))[-3:])
            elif missing - self._real[-1][0] <= BRIDGED:
                self._make_up(missing, tuple(self._real))
            else:
                return False
        return True

    def _put(self, sequence: int) -> None:
        q = self._waiting.pop(sequence)
        self._keep(sequence, q)
        self._points.append(q)
        self._head = sequence

    def _keep(self, sequence: int, q: Floats) -> None:
        self.lost += min(sequence - self._real[-1][0] - 1, self.MAX_WAITING)
        self._real.append((sequence, q))

    def _make_up(self, sequence: int, known: tuple[tuple[int, Floats], ...]) -> None:
        """Replace a missing set-point by a point on the parabola through its neighbours."""
        (last, q), (before, q_before) = known[-1], known[-2]
        chord = (q - q_before) / (last - before)
        point = q + (sequence - last) * chord
        if len(known) == 3 and last - before <= BRIDGED + 1:  # across a gap, use the straight line
            first, q_first = known[0]
            bend = (chord - (q_before - q_first) / (before - first)) / (last - first)
            point = point + (sequence - last) * (sequence - before) * bend
        self._points.append(np.clip(point, -self._reach, self._reach))
        self._head = sequence

    def _wait(self) -> tuple[Floats, Floats]:
        if self._pause is None:
            self._pause = self.end
        return self._pause.next(), self._pause.velocity


def linear(
    points: Sequence[Floats],  # the last four, each of shape (n,)
    u: float,  # place between the last two, 0 < u ≤ 1; at 1 the value is exactly the last point [-]
    rate: float,  # of u [1/s]
) -> tuple[Floats, Floats, float]:
    """Interpolate linearly; return value, derivative (a parabola's, without steps) and largest derivative."""
    found = np.empty((2, len(points[0])))
    fastest = on_parabola(points[1], points[2], points[3], u, rate, found)
    return found[0], found[1], fastest


def cubic(points: Sequence[Floats], u: float, rate: float) -> tuple[Floats, Floats, float]:
    """Evaluate the uniform cubic B-spline between the middle two of four points; see `linear`.

    The spline's second derivative varies linearly between the points' second differences, and its third
    derivative is their third difference, so the spline keeps the points' limits of velocity, acceleration and
    jerk. It passes the points at a distance of q''/6 on the inside of the bend (de Boor 1978, ch. IX to XI).
    """
    v = 1.0 - u
    found = np.empty((2, len(points[0])))
    inner = (1.0 + u * (3.0 + u * (3.0 - 2.0 * u))) / 6.0
    values, slopes = (v**3 / 6.0, inner, u**3 / 6.0), (0.5 * v * v, 0.5 + u * v, 0.5 * u * u)
    fastest = on_cubic(points[0], points[1], points[2], points[3], values, slopes, rate, found)
    return found[0], found[1], fastest


@compiled_for_ticks
def on_parabola(before: Floats, middle: Floats, last: Floats, u: float, rate: float, found: Floats) -> float:
    """Compute the results of `linear`: value and derivative (2, n), and the largest derivative."""
    fastest = 0.0
    for j in range(last.shape[0]):
        fall, rise = middle[j] - before[j], last[j] - middle[j]
        found[0, j] = last[j] if u == 1.0 else middle[j] + u * rise
        found[1, j] = rate * (rise + (u - 0.5) * (rise - fall))
        fastest = max(fastest, abs(found[1, j]))
    return fastest


@compiled_for_ticks
def on_cubic(
    first: Floats,
    second: Floats,
    third: Floats,
    fourth: Floats,
    values: tuple[float, float, float],
    slopes: tuple[float, float, float],
    rate: float,
    found: Floats,
) -> float:
    """Compute the results of `cubic`, as `on_parabola`, from weights of the points' differences."""
    fastest = 0.0
    for j in range(first.shape[0]):
        # Use differences, so that equal points give exactly their own value.
        a, b, c = second[j] - first[j], third[j] - second[j], fourth[j] - third[j]
        found[0, j] = second[j] - values[0] * a + values[1] * b + values[2] * c
        found[1, j] = rate * (slopes[0] * a + slopes[1] * b + slopes[2] * c)
        fastest = max(fastest, abs(found[1, j]))
    return fastest

"""When set-points are played: late enough for those that come late."""

import math
from collections import deque

from tvist_controller.trajectory.limits import MotionLimits

WINDOW = 128
"""Set-points over which lateness is remembered, in four parts."""
MAX_PERIODS, MAX_SECONDS = 2.0, 0.02
"""Longest wait for set-points later than the earliest: the larger of the two."""
SPARE = 1
"""Periods that a stream slower than the tick is waited for in any case, so that it may begin with jitter [-]."""
SLACK = 0.3
"""Wait longer than needed that is put up with, so that it need not change all the time [periods]."""
SHARE = 0.05
"""Share of the limits that changing the delay may take up [-]."""
CALM = 0.5
"""Time without need after which a delay that the limits made necessary is given up [s]."""
SLOW = 0.05
"""Share of the velocity limit below which it is [-]."""
CLOSE = 1e-6
"""Distance at which the delay counts as the wanted one [ticks]."""


class PlayOut:
    """The position in a stream that is played at each tick, in sequence numbers.

    The sender's clock is not ours, and the way here takes what it takes. Lateness of set-point k is the tick before
    which it arrived less k periods. Play-out waits for the latest of the last ones, but not by much more than the
    earliest needs; so jitter is waited out, a clock that is slow or fast is followed, and a break is not waited
    for. The delay goes to where it should be through three lags in a row, which cannot overshoot: with q' the stream's
    velocity, and D the delay, q̈ has a part -q' D̈. The lags' time constant keeps this, and what it does to jerk, to a
    share of the limits; at rest it is nothing.

    Args:
        first: Set-point to play next; it has just come.
        look_ahead: Periods between the position and the newest set-point it needs [-].
        ticks: Ticks in a period of the stream, at least one [-].
        limits: Limits of the stream.
        period: Tick [s].
    """

    def __init__(
        self, first: int, look_ahead: int, ticks: float, limits: MotionLimits, period: float
    ) -> None:
        self._limits, self._period, self._ticks = limits, period, ticks
        self._base = (look_ahead + SPARE * (ticks > 1.0)) * ticks - 1.0
        self._most = max(MAX_PERIODS * ticks, MAX_SECONDS / period)
        self._origin, self._now = first, 0
        self._parts: deque[tuple[float, float]] = deque(maxlen=4)
        self._part, self._count = (0.0, 0.0), 0
        self._wanted = self._base
        self._held, self._calm = self._base, 0
        self._lags, self._rate = [self._base] * 3, 0.0

    @property
    def delay(self) -> float:
        """Between a set-point that comes as early as any, and when its position is reached [ticks]."""
        return self._lags[2] - self._earliest

    @property
    def position(self) -> tuple[int, float]:
        """An exact origin and the play-out position from there [sequence numbers]."""
        # Rounded, so that it meets whole numbers where it should.
        return self._origin, round((self._now - self._lags[2]) / self._ticks, 9)

    def breaks(self, sequence: int) -> bool:
        """Whether a set-point that arrived before the coming tick is far from when it was to be expected."""
        return abs(self._lateness(sequence) - self._earliest) > self._most

    def _lateness(self, sequence: int) -> float:
        return round(self._now - (sequence - self._origin) * self._ticks, 6)

    @property
    def _earliest(self) -> float:
        return min(part[0] for part in (self._part, *self._parts))

    def hear(self, sequence: int) -> None:
        """Learn from a set-point that arrived before the coming tick."""
        lateness = self._lateness(sequence)
        if lateness - self._earliest > self._most:
            return  # a straggler: it is not waited for
        self._part = (min(self._part[0], lateness), max(self._part[1], lateness))
        self._count += 1
        if self._count >= WINDOW // 4:
            self._parts.append(self._part)
            self._part, self._count = (lateness, lateness), 0
        latest = max(part[1] for part in (self._part, *self._parts))
        wanted = self._base + min(latest, self._earliest + self._most)
        if wanted > self._wanted or wanted < self._wanted - SLACK * self._ticks:
            self._wanted = wanted

    def advance(self, speed: float, behind: float) -> None:
        """Go on by a tick.

        Args:
            speed: The fastest joint's in the stream [rad/s].
            behind: Time by which the reference stays behind the stream without hope of catching up [s].
        """
        self._now += 1
        delay = self._lags[2]
        if behind > 0.0:
            self._held = min(delay + behind / self._period, self._wanted + self._most)
            self._calm = 0
        else:
            self._calm += 1
            if self._calm > CALM / self._period and speed < SLOW * self._limits.velocity:
                self._held = self._base
        goal = max(self._wanted, self._held)
        if delay == goal and self._rate == 0.0:
            return
        gap = max(abs(lag - goal) for lag in self._lags)
        if gap < CLOSE:
            self._lags, self._rate = [goal] * 3, 0.0
            return
        way = speed * gap * self._period / SHARE
        slow = max(math.sqrt(way / self._limits.acceleration), math.cbrt(way / self._limits.jerk))
        share = self._period / (self._period + slow)
        ahead = goal
        for number in range(3):
            ahead = self._lags[number] = self._lags[number] + share * (ahead - self._lags[number])
        self._rate = ahead - delay

    @property
    def rate(self) -> float:
        """Set-points played in a tick, at present [-]."""
        return (1.0 - self._rate) / self._ticks

"""Play-out timing of a stream, delayed enough for late set-points to arrive."""

import math
from collections import deque

from tvist_controller.trajectory.base import MotionLimits
from tvist_plant.plant import PERIOD

WINDOW = 128  # number of set-points over which lateness is observed, in four parts
MAX_PERIODS, MAX_SECONDS = 2.0, 0.02
"""Longest wait for late set-points relative to the earliest; the larger value applies."""
SPARE_PERIODS = 1  # additional delay of a stream slower than the tick, for jitter at the start [periods]
SLACK = 0.3  # tolerated excess delay, which avoids constant changes [periods]
SHARE = 0.05  # fraction of the limits available to a change of delay [-]
CALM = 0.5  # time after which a delay required by the limits is reduced if no longer needed [s]
SLOW_SHARE = 0.05  # fraction of the velocity limit below which the delay may be reduced [-]
CLOSE = 1e-6  # difference below which the delay equals its target [ticks]


class PlayOut:
    """Position of a stream to play at each tick, in sequence numbers.

    The sender's clock may differ, and transport delay varies. If set-point k arrives before tick i, its
    lateness is i minus k periods. The play-out delay D suits the latest of recent set-points, but is not much
    longer than the earliest needs. So play-out compensates jitter, follows a slow or fast clock, and does not
    wait for gaps. D follows its target through three first-order lags, without overshoot. With stream
    velocity q', q̈ contains -q' D̈; the lags' time constant, zero at rest, keeps this term and its jerk
    within a fraction of the limits.
    """

    def __init__(
        self,
        first: int,  # set-point to play next; it has just arrived
        look_ahead: int,  # periods between the position and the newest set-point it needs [-]
        ticks: float,  # per period of the stream, at least one [-]
        limits: MotionLimits,  # of the stream
    ) -> None:
        self._limits, self._ticks = limits, ticks
        self._base = (look_ahead + SPARE_PERIODS * (ticks > 1.0)) * ticks - 1.0
        self._most = max(MAX_PERIODS * ticks, MAX_SECONDS / PERIOD)
        self._origin, self._now = first, 0
        self._parts: deque[tuple[float, float]] = deque(maxlen=4)
        self._part, self._count = (0.0, 0.0), 0
        self._earliest = self._latest = 0.0  # over all parts
        self._wanted = self._base
        self._held, self._calm = self._base, 0
        self._lags, self._rate = [self._base] * 3, 0.0

    @property
    def delay(self) -> float:
        """Time from arrival to play-out of set-points that come earliest relative to their number [ticks]."""
        return self._lags[2] - self._earliest

    @property
    def position(self) -> tuple[int, float]:
        """Integer origin, and play-out position relative to it [sequence numbers]."""
        # Rounded, so that it is exactly an integer where it should be.
        return self._origin, round((self._now - self._lags[2]) / self._ticks, 9)

    def breaks(self, sequence: int) -> bool:
        """Return whether a set-point that arrives for the coming tick is far from its expected time."""
        return abs(self._lateness(sequence) - self._earliest) > self._most

    def _lateness(self, sequence: int) -> float:
        return round(self._now - (sequence - self._origin) * self._ticks, 6)

    def hear(self, sequence: int) -> None:
        """Record a set-point that arrived before the coming tick."""
        lateness = self._lateness(sequence)
        if lateness - self._earliest > self._most:
            return  # too late to wait for
        early, late = self._part
        self._part = (min(early, lateness), max(late, lateness))
        self._earliest, self._latest = min(self._earliest, lateness), max(self._latest, lateness)
        self._count += 1
        if self._count >= WINDOW // 4:
            self._parts.append(self._part)
            self._part, self._count = (lateness, lateness), 0
            self._earliest = min(early for early, _ in self._parts)
            self._latest = max(late for _, late in self._parts)
        wanted = self._base + min(self._latest, self._earliest + self._most)
        if wanted > self._wanted or wanted < self._wanted - SLACK * self._ticks:
            self._wanted = wanted

    def advance(self, speed: float, behind: float) -> None:
        """Advance by one tick; `speed`: fastest joint's velocity [rad/s]; `behind`: reference's lag [s]."""
        self._now += 1
        delay = self._lags[2]
        if behind > 0.0:
            self._held = min(delay + behind / PERIOD, self._wanted + self._most)
            self._calm = 0
        else:
            self._calm += 1
            if self._calm > CALM / PERIOD and speed < SLOW_SHARE * self._limits.velocity:
                self._held = self._base
        goal = max(self._wanted, self._held)
        if delay == goal and self._rate == 0.0:
            return
        gap = max(abs(lag - goal) for lag in self._lags)
        if gap < CLOSE:
            self._lags, self._rate = [goal] * 3, 0.0
            return
        way = speed * gap * PERIOD / SHARE
        slow = max(math.sqrt(way / self._limits.acceleration), math.cbrt(way / self._limits.jerk))
        share = PERIOD / (PERIOD + slow)
        ahead = goal
        for number in range(3):
            ahead = self._lags[number] = self._lags[number] + share * (ahead - self._lags[number])
        self._rate = ahead - delay

    @property
    def rate(self) -> float:
        """Set-points played per tick [-]."""
        return (1.0 - self._rate) / self._ticks

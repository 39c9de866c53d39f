"""Transition from one filter to another while the reference moves.

Both filters get the same reference, and the output is y = o + s (n - o), with o the old filter's output, n the new
one's, and s the share of the new one, from 0 to 1. While s is constant, y is a mean of o and n and keeps all limits
that both keep. While s changes,

    ÿ = (1 - s) ö + s n̈ + 2 ṡ (ṅ - ȯ) + s̈ (n - o),

so a fade of fixed duration would exceed the limits whenever the motion itself uses them fully. (Shortening the delay
means playing the motion faster than it arrives, which is impossible for a motion at its limits.) Hence s moves as fast
as the motion leaves room for, but never so fast that it could not be stopped if the motion then took that room away at
the jerk limit. If n lags behind o, s cannot be stopped until a joint that accelerates at its limit has reached its
velocity limit, but it slows down by itself; its speed is then limited such that the fade does not end before that.
Without room, s waits. When the reference is at rest, o and n agree and nothing is left to fade.
"""

import math
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_kernels.compiling import compiled
from tvist_shaping._types import Floats, Forkable
from tvist_shaping.base import Filter
from tvist_shaping.errors import FilterError, check_positive

NEGLIGIBLE = 1e-10  # difference between two outputs that has no effect [rad]
ROUNDING = 1e-7  # share of the acceleration limit that the last step to s = 1 may add [-]
EQUAL = 1e-6  # difference between two mean delays that counts as zero [s]
STRAIGHT = 1e-6
"""Deviation of a joint from the straight line of the others that is tolerated, as a share of its largest step [-]."""
QUICKEST = 0.3
"""Shortest duration of a fade [s], even with unlimited room: it must be slow compared with the vibration."""
PUSH = 0.4
"""Share of the limits of acceleration and jerk that s uses to speed up, and to come to rest at 1 [-]."""
STOP = 0.5  # share of the room that is assumed to be available for stopping s [-]
MARGIN = 0.02  # smallest share of the acceleration limit that is excluded from the room [-]
COAST = 0.5  # share of the remaining way that s may coast while it cannot be stopped but exceeds no limit [-]
BACK = 0.5  # share of a joint's velocity that the fade may remove, so that no joint turns back [-]
EASE = 0.02  # time constant with which ṡ approaches its highest safe value [s]


@compiled
def blend(  # noqa: C901, PLR0912, PLR0915 - one kernel: its branches are loops over joints
    old: Floats,
    new: Floats,
    out: Floats,
    progress: tuple[float, float, float],
    limits: tuple[float, float, float],
    period: float,
    lag: tuple[float, float],
) -> tuple[float, float, float]:
    """Compute one tick of a fade, and return its s, ṡ and s̈; s is 1 when the fade is complete.

    `old` and `new` are the filters' outputs at the last three ticks, the present one last [rad], shape
    (3, joints), and `out` the fade's, whose last row is written. `progress` is what the previous tick
    returned: s [-], ṡ [1/s] and s̈ [1/s²]. `limits` are the velocity [rad/s], acceleration [rad/s²] and jerk
    [rad/s³] of every joint. `lag` is how much longer the new filter's mean delay is than the old one's [s],
    and the rate of change of this difference [-].
    """
    share, rate, slope = progress
    velocity, acceleration, jerk = limits
    later, drift = lag
    joints = old.shape[1]
    apart, widest, first = 0.0, NEGLIGIBLE, 0
    for k in range(joints):
        if abs(new[2, k] - old[2, k]) > widest:
            widest, first = abs(new[2, k] - old[2, k]), k
        for i in range(3):
            apart = max(apart, abs(new[i, k] - old[i, k]))
    h2 = period * period
    if (1.0 - share) * apart <= ROUNDING * acceleration * h2:
        for k in range(joints):
            out[2, k] = new[2, k]
        return 1.0, 0.0, 0.0
    least, most = -math.inf, math.inf  # bounds of s for the limits of this tick
    # Highest ṡ from which s can come to rest at 1 with a share of the jerk limit.
    left, push = 1.0 - share, PUSH * jerk / widest
    safe = min(2.0 / QUICKEST, 0.5 * push ** (1.0 / 3.0) * (6.0 * left) ** (2.0 / 3.0))
    safe = min(safe, min(jerk / acceleration, 0.2 / period) * left)
    # Room: acceleration left after one more tick at the jerk limit, which is assumed to use half at most.
    counted = acceleration - max(MARGIN * acceleration, min(jerk * period, 0.5 * acceleration))
    # Bounds for stopping s after the motion has taken the room away, and for moving s without room.
    brake, closed, coast, back = math.inf, math.inf, math.inf, math.inf
    # Time in which s slows down to a quarter by itself, while a joint has no room.
    slows = 0.0
    for k in range(joints):
        d = new[2, k] - old[2, k]
        sign = 1.0 if d >= 0.0 else -1.0
        old_qdd = (old[2, k] - 2.0 * old[1, k] + old[0, k]) / h2
        new_qdd = (new[2, k] - 2.0 * new[1, k] + new[0, k]) / h2
        if later > EQUAL and counted + sign * (share * new_qdd + left * old_qdd) <= 0.0:
            slows = max(slows, abs(d) / (later * acceleration))
    along = new[2, first] - new[0, first]
    for k in range(joints):
        d = new[2, k] - old[2, k]
        sign = 1.0 if d >= 0.0 else -1.0
        size = max(abs(d), NEGLIGIBLE)
        old_qdd = (old[2, k] - 2.0 * old[1, k] + old[0, k]) / h2
        new_qdd = (new[2, k] - 2.0 * new[1, k] + new[0, k]) / h2
        old_qd, new_qd = (old[2, k] - old[1, k]) / period, (new[2, k] - new[1, k]) / period
        # A time-varying filter may exceed the reference's limits by itself.
        qdd_max = (1.0 + ROUNDING) * max(acceleration, abs(old_qdd), abs(new_qdd))
        qd_max = (1.0 + ROUNDING) * max(velocity, abs(old_qd), abs(new_qd))
        # The differences of the output are linear in s, so each limit is an interval of s.
        middle = -sign * (old[2, k] - 2.0 * out[1, k] + out[0, k]) / size
        least = max(least, middle - qdd_max * h2 / size)
        most = min(most, middle + qdd_max * h2 / size)
        middle = -sign * (old[2, k] - out[1, k]) / size
        least = max(least, middle - qd_max * period / size)
        most = min(most, middle + qd_max * period / size)
        # Stopping s uses the room opposite to the motion's own acceleration. The motion may take this room away at
        # the jerk limit; until then, a velocity of room²/(2 jerk) can be removed.
        qdd, qd = share * new_qdd + left * old_qdd, share * new_qd + left * old_qd
        room = counted + sign * qdd
        turning = 2.0 * abs(d - new[1, k] + old[1, k])
        if abs(d) < turning:  # d passes through zero, so the sides are swapped within a tick
            room, size = min(room, counted - sign * qdd), turning
        brake, closed = min(brake, max(room, 0.0) / size), min(closed, max(room, 0.0) / jerk)
        # A longer delay holds the joint back. While the joint accelerates at its limit, d grows and s slows down by
        # itself, as 1/d², without using the joint's acceleration, until the joint is at its velocity limit. That has
        # to happen before s is 1.
        lasts = max(qd_max + sign * qd, 0.0) / acceleration + 2.0 * acceleration / jerk
        grows = (later + min(drift, 0.0) * lasts) * acceleration - qd_max * abs(drift)  # |ḋ| at the least
        shrinks = sign * qdd < 0.0 and sign * (new_qd - old_qd) < -1e-4 * velocity
        # Joints off a common straight line may block s one after the other, so the fade's end would be uncertain.
        aside = (
            abs(d * along - (new[2, first] - old[2, first]) * (new[2, k] - new[0, k]))
            > STRAIGHT * widest * velocity * period
        )
        if aside or shrinks or grows < 0.0 or later <= EQUAL:
            coast = 0.0
        else:
            width = max(size, slows * grows)
            coast = min(coast, COAST * left * (width + grows * lasts) / (lasts * width))
        if sign * qd < 0.0:
            back = min(back, BACK * abs(qd) / size)
    rest = 2.0 * STOP * left  # ṡ² divided by s̈ for coming to rest at s = 1
    slow = min(0.5 * STOP * brake * closed, math.sqrt(rest * min(brake, PUSH * acceleration / widest)))
    slow = max(slow, min(coast, math.sqrt(rest * PUSH * acceleration / widest)))
    safe = min(safe, slow, back)
    # ṡ approaches `safe` gradually. At `hard`, s can just be stopped if all of the room is available.
    hard = max(min(0.5 * brake * closed, math.sqrt(2.0 * left * brake)), coast)
    wish = (safe - rate) / (EASE if safe > rate else period)
    slope = max(min(wish, slope + push * period), slope - jerk / widest * period)
    slope = min(slope, PUSH * acceleration / widest, 6.0 / QUICKEST**2)
    wanted = max(rate + period * slope, 0.0)
    if wanted > hard:
        wanted, slope = hard, min(slope, 0.0)
    if least > most:  # joints with contradictory bounds: none gets more than its room
        s = share + period * max(rate - period * brake, 0.0)
    else:
        s = min(max(share + period * wanted, least), most)
    # Even the limits must not speed s up: when d passes through zero, they would do so without bound.
    s = min(max(s, share), share + period * max(rate, wanted), 1.0)
    for k in range(joints):
        out[2, k] = old[2, k] + s * (new[2, k] - old[2, k])
    return s, (s - share) / period, slope


class Fade(Forkable):
    """Changes from one filter to another during a motion, and keeps the motion's limits meanwhile.

    As long as the reference keeps limits of velocity, acceleration and jerk, the output keeps those of velocity and
    acceleration. If one of the filters exceeds them by itself, as time-varying ones slightly do, the output exceeds
    them by no more than that filter. All joints fade together, so a straight line stays straight. The duration depends
    on the motion; the fade is complete at the latest when the reference has been at rest for the duration of both
    filters.

    Attributes:
        old: Filter at the beginning.
        new: Filter at the end.
        share: Share of the new filter in the output [-], 0 to 1.
    """

    def __init__(
        self, old: Filter, new: Filter, *, velocity: float, acceleration: float, jerk: float
    ) -> None:
        """Create a fade at its beginning.

        Args:
            old: Present filter, whose output continues without a step.
            new: New filter. It takes over the old filter's history of the motion.
            velocity: Velocity limit of the motion, for every joint [rad/s], > 0.
            acceleration: Acceleration limit of the motion, for every joint [rad/s²], > 0.
            jerk: Jerk limit of the motion, for every joint [rad/s³], > 0.

        Raises:
            FilterError: A limit is out of range, or the filters have different periods.
            ShapingError: The filters have different numbers of joints.
        """
        check_positive(FilterError, velocity=velocity, acceleration=acceleration, jerk=jerk)
        if old.period != new.period:
            raise FilterError("period", new.period, f"{old.period:g} s, as the filter's it takes over from")
        new.take_over(old)
        self.old, self.new, self.share = old, new, 0.0
        self._limits = (float(velocity), float(acceleration), float(jerk))
        self._rate, self._slope, self._later = 0.0, 0.0, 0.0
        self._history: Floats = np.zeros((3, 3, old.width))
        self._ticks = 0

    @property
    def finished(self) -> bool:
        """Whether the last output was entirely the new filter's, as all later ones will be."""
        return self.share == 1.0

    def fork(self) -> Self:
        """Return an independent copy; see `Filter.fork`."""
        other = super().fork()
        if self.new.estimator is self.old.estimator:  # both use its state
            other.new.estimator = other.old.estimator
        return other

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape one sample; see `Filter.filter`."""
        if self.finished:
            return self.new.filter(q_ref)
        history = self._history
        history[:, :2] = history[:, 1:]
        old, new, out = history
        old[2], new[2] = self.old.filter(q_ref), self.new.filter(q_ref)
        out[2] = old[2]
        if self._ticks < 2:  # an acceleration needs three samples
            self._ticks += 1
            self._later = self.new.mean_delay - self.old.mean_delay
        else:
            later = self.new.mean_delay - self.old.mean_delay
            drift, self._later = (later - self._later) / self.new.period, later
            progress = (self.share, self._rate, self._slope)
            self.share, self._rate, self._slope = blend(
                old, new, out, progress, self._limits, self.new.period, (later, drift)
            )
        return np.array(out[2])

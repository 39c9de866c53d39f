"""Transition from one filter to another while the reference moves.

The two are fed the same reference, and the output is y = o + s (n - o): o the old one's, n the new one's, s the
share of the new one, from 0 to 1. While s stands still, y is a mean of o and n and keeps every limit that both
keep. While it moves,

    ÿ = (1 - s) ö + s n̈ + 2 ṡ (ṅ - ȯ) + s̈ (n - o),

so a fade of a fixed length leaves the limits wherever the motion itself uses them to the full. (To shorten the
delay is to play the motion faster than it comes, and a motion at its limits cannot be.) Hence s goes as fast as the
room that the motion leaves, and no faster than it could be stopped again if the motion took that room away at the
jerk limit; or, where n is later than o, no faster than it is over when a joint at its limit of acceleration has come to
that of velocity, for until then s cannot be stopped, but slows down by itself. Where there is no room it waits; where
the reference rests, o and n agree and nothing is left to fade.
"""

import copy
import math
from typing import Self

import numpy as np
import numpy.typing as npt

from tvist_shaping._compiled import compiled
from tvist_shaping._types import Floats
from tvist_shaping.base import Filter
from tvist_shaping.errors import FilterError

NEGLIGIBLE = 1e-10
"""Distance between two outputs that makes no difference [rad]."""
ROUNDING = 1e-7
"""Share of the acceleration limit that the step from almost 1 to 1 may add [-]."""
EQUAL = 1e-6
"""Difference of two mean delays that counts as zero [s]."""
STRAIGHT = 1e-6
"""Share of the farthest a joint may go in a tick by which it may be off the straight line of the others [-]."""
QUICKEST = 0.3
"""A fade takes no less time [s], however much room there is: it is meant to be slow against the vibration."""
PUSH = 0.4
"""Share of the limits of acceleration and jerk with which s is hurried and comes to rest at 1 [-]."""
STOP = 0.5
"""Share of the room that is counted on for stopping s [-]."""
MARGIN = 0.02
"""Share of the acceleration limit that is not counted as room, at least [-]."""
COAST = 0.5
"""Share of the way left that s may go on by itself, where it cannot be stopped but does no harm [-]."""
BACK = 0.5
"""Share of a joint's velocity that the fade may take away: no joint is to turn back for it [-]."""
EASE = 0.02
"""Time in which ṡ eases to the highest that is safe [s]."""


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
    """One tick of a fade.

    Args:
        old: The old filter's output two ticks ago, one tick ago and now [rad], shape (3, joints).
        new: The new filter's, likewise.
        out: What was given out, likewise; its last row is written.
        progress: Of the tick before: s [-], 0 to 1; ṡ [1/s], >= 0; s̈ that ṡ was wanted to change at [1/s²].
        limits: For every joint: velocity [rad/s], acceleration [rad/s²], and how fast the motion's acceleration
            changes at most [rad/s³].
        period: Tick [s].
        lag: How much longer the new filter's mean delay is than the old one's [s], and its rate of change [-].

    Returns:
        s, ṡ and s̈ of this tick; s is 1 where the fade is over.
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
        out[2] = new[2]
        return 1.0, 0.0, 0.0
    least, most = -math.inf, math.inf  # of s, for the limits of this tick
    # Highest ṡ from which s comes to rest at 1 with a part of the jerk limit.
    left, push = 1.0 - share, PUSH * jerk / widest
    safe = min(2.0 / QUICKEST, 0.5 * push ** (1.0 / 3.0) * (6.0 * left) ** (2.0 / 3.0))
    safe = min(safe, min(jerk / acceleration, 0.2 / period) * left)
    # Room is what the motion leaves after another tick; one that can take all of it in a tick is believed to take half.
    counted = acceleration - max(MARGIN * acceleration, min(jerk * period, 0.5 * acceleration))
    # What there is to slow s with, when the motion may have taken it away, and how fast s may go where it has.
    brake, closed, coast, back = math.inf, math.inf, math.inf, math.inf
    # In this time s slows down to a quarter by itself, where a joint without room holds it.
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
        # A filter whose parameters vary may exceed the reference's limits by itself.
        qdd_max = (1.0 + ROUNDING) * max(acceleration, abs(old_qdd), abs(new_qdd))
        qd_max = (1.0 + ROUNDING) * max(velocity, abs(old_qd), abs(new_qd))
        # The differences of the output are linear in s: a limit is an interval of s.
        middle = -sign * (old[2, k] - 2.0 * out[1, k] + out[0, k]) / size
        least = max(least, middle - qdd_max * h2 / size)
        most = min(most, middle + qdd_max * h2 / size)
        middle = -sign * (old[2, k] - out[1, k]) / size
        least = max(least, middle - qd_max * period / size)
        most = min(most, middle + qd_max * period / size)
        # Stopping s takes room on the far side of the motion's own acceleration. The motion may close it at the
        # jerk limit, and until then a velocity of room²/(2 jerk) can be taken back.
        qdd, qd = share * new_qdd + left * old_qdd, share * new_qd + left * old_qd
        room = counted + sign * qdd
        turning = 2.0 * abs(d - new[1, k] + old[1, k])
        if abs(d) < turning:  # d passes through zero: what was the far side is the near one in a tick
            room, size = min(room, counted - sign * qdd), turning
        brake, closed = min(brake, max(room, 0.0) / size), min(closed, max(room, 0.0) / jerk)
        # A longer delay holds the joint back. Where the joint accelerates at its limit, d grows, and s slows down by
        # itself, as 1/d²: that takes nothing of its acceleration. It lasts until the joint is at its highest velocity,
        # which is to be before s is 1.
        lasts = max(qd_max + sign * qd, 0.0) / acceleration + 2.0 * acceleration / jerk
        grows = (later + min(drift, 0.0) * lasts) * acceleration - qd_max * abs(drift)  # |ḋ| at the least
        shrinks = sign * qdd < 0.0 and sign * (new_qd - old_qd) < -1e-4 * velocity
        # Joints off one straight line may each hold s, one after the other, and nothing is sure of an end.
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
    rest = 2.0 * STOP * left  # ṡ² by s̈: from which s rests at 1
    slow = min(0.5 * STOP * brake * closed, math.sqrt(rest * min(brake, PUSH * acceleration / widest)))
    slow = max(slow, min(coast, math.sqrt(rest * PUSH * acceleration / widest)))
    safe = min(safe, slow, back)
    # Towards these ṡ eases; from this one and no faster s can just be stopped, with all the room there is.
    hard = max(min(0.5 * brake * closed, math.sqrt(2.0 * left * brake)), coast)
    wish = (safe - rate) / (EASE if safe > rate else period)
    slope = max(min(wish, slope + push * period), slope - jerk / widest * period)
    slope = min(slope, PUSH * acceleration / widest, 6.0 / QUICKEST**2)
    wanted = max(rate + period * slope, 0.0)
    if wanted > hard:
        wanted, slope = hard, min(slope, 0.0)
    if least > most:  # joints that want different things: none gets more than its room
        s = share + period * max(rate - period * brake, 0.0)
    else:
        s = min(max(share + period * wanted, least), most)
    # Not even the limits may drive s on: where d passes through zero they would drive it without end.
    s = min(max(s, share), share + period * max(rate, wanted), 1.0)
    for k in range(joints):
        out[2, k] = old[2, k] + s * (new[2, k] - old[2, k])
    return s, (s - share) / period, slope


class Fade:
    """Shapes like one filter to begin with, like another in the end, and keeps a motion's limits in between.

    For as long as the reference keeps limits of velocity, acceleration and jerk, the output keeps those of velocity
    and acceleration; where one of the filters exceeds them by itself, as time-varying ones do a little, it exceeds
    them by no more. All joints fade together: a straight line stays one. How long it takes is up to the motion; it
    is over at the latest when the reference has rested for as long as both filters last.

    Attributes:
        old: The filter it comes from.
        new: The filter it goes to.
        share: How much of the output is the new filter's [-], 0 to 1.
    """

    old: Filter
    new: Filter
    share: float

    def __init__(
        self, old: Filter, new: Filter, *, velocity: float, acceleration: float, jerk: float
    ) -> None:
        """A fade at its beginning.

        Args:
            old: The filter in force; whatever it does goes on without a step.
            new: The filter to come. It takes over what the old one knows of the motion.
            velocity: Limit of the motion, for every joint [rad/s], > 0.
            acceleration: Limit of the motion, for every joint [rad/s²], > 0.
            jerk: Limit of the motion, for every joint [rad/s³], > 0.

        Raises:
            FilterError: A limit is out of range, or the filters have different periods.
            ShapingError: The filters have different joints.
        """
        for name, value in (("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)):
            if not 0.0 < value < math.inf:
                raise FilterError(name, value, "a finite number above 0")
        if old.period != new.period:
            raise FilterError("period", new.period, f"{old.period:g} s, as the filter's it takes over from")
        new.take_over(old)
        self.old, self.new, self.share = old, new, 0.0
        self._limits = (float(velocity), float(acceleration), float(jerk))
        self._rate, self._slope, self._later = 0.0, 0.0, 0.0
        self._history: Floats = np.zeros((3, 3, old.width))
        self._ticks = 0

    def __repr__(self) -> str:
        return f"Fade({self.old!r}, {self.new!r}, share={self.share:.3f})"

    @property
    def finished(self) -> bool:
        """Whether the output is the new filter's, from the last one on."""
        return self.share == 1.0

    def fork(self) -> Self:
        """An independent copy that goes on from here, with copies of both filters; see `Filter.fork`."""
        other = copy.copy(self)
        other.old, other.new = self.old.fork(), self.new.fork()
        if self.new.estimator is self.old.estimator:  # one that both ask remembers what either asked
            other.new.estimator = other.old.estimator
        other._history = self._history.copy()  # noqa: SLF001  one of its own kind
        return other

    def filter(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape one sample.

        Args:
            q_ref: Reference x_i, shape (width,), finite: joint angles [rad], or the parameter of a path.

        Returns:
            Shaped reference x*_i, shape (width,), the caller's own.

        Raises:
            ShapingError: q_ref has another shape.
        """
        if self.finished:
            return self.new.filter(q_ref)
        history = self._history
        history[:, :2] = history[:, 1:]
        old, new, out = history
        old[2], new[2] = self.old.filter(q_ref), self.new.filter(q_ref)
        out[2] = old[2]
        if self._ticks < 2:  # it takes three samples to know an acceleration
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

"""From one filter to another while the reference moves.

The two are fed the same reference, and the output is y = o + s (n - o): o the old one's, n the new one's, s the
share of the new one, from 0 to 1. While s stands still, y is a mean of o and n and keeps every limit that both
keep. While it moves,

    ÿ = (1 - s) ö + s n̈ + 2 ṡ (ṅ - ȯ) + s̈ (n - o),

so a fade of a fixed length leaves the limits wherever the motion itself uses them to the full. (To shorten the
delay is to play the motion faster than it comes, and a motion at its limits cannot be.) Hence s goes as fast as the
room that the motion leaves, and no faster than it could be stopped again if the motion took that room away at the
jerk limit. Where there is no room it waits; where the reference rests, o and n agree and nothing is left to fade.
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
QUICKEST = 0.3
"""A fade takes no less time [s], however much room there is: it is meant to be slow against the vibration."""
PUSH = 0.4
"""Share of the limits of acceleration and jerk with which s is hurried and comes to rest at 1 [-]."""
STOP = 0.5
"""Share of the room that is counted on for stopping s [-]."""
MARGIN = 0.02
"""Share of the acceleration limit that is not counted as room [-]."""
COAST = 0.5
"""Share of the way left that s may go on by itself, where it cannot be stopped but does no harm [-]."""
BACK = 0.5
"""Share of a joint's velocity that the fade may take away: no joint is to turn back for it [-]."""
EASE = 0.02
"""Time in which ṡ eases to the highest that is safe [s]."""


@compiled
def blend(
    old: Floats,
    new: Floats,
    out: Floats,
    share: float,
    rate: float,
    slope: float,
    velocity: float,
    acceleration: float,
    jerk: float,
    period: float,
) -> tuple[float, float, float]:
    """One tick of a fade.

    Args:
        old: The old filter's output two ticks ago, one tick ago and now [rad], shape (3, joints).
        new: The new filter's, likewise.
        out: What was given out, likewise; its last row is written.
        share: s of the tick before [-], 0 to 1.
        rate: ṡ [1/s], >= 0.
        slope: s̈ that ṡ was wanted to change at [1/s²].
        velocity: Limit for every joint [rad/s].
        acceleration: Limit for every joint [rad/s²].
        jerk: How fast the motion's acceleration changes at most [rad/s³].
        period: Tick [s].

    Returns:
        s, ṡ and s̈ of this tick; s is 1 where the fade is over.
    """
    joints = old.shape[1]
    apart, widest = 0.0, NEGLIGIBLE
    for k in range(joints):
        widest = max(widest, abs(new[2, k] - old[2, k]))
        for i in range(3):
            apart = max(apart, abs(new[i, k] - old[i, k]))
    if (1.0 - share) * apart <= NEGLIGIBLE:
        out[2] = new[2]
        return 1.0, 0.0, 0.0
    h2 = period * period
    least, most = -math.inf, math.inf  # of s, for the limits of this tick
    # Highest ṡ from which s comes to rest at 1 with a part of the jerk limit.
    left, push = 1.0 - share, PUSH * jerk / widest
    safe = min(2.0 / QUICKEST, 0.5 * push ** (1.0 / 3.0) * (6.0 * left) ** (2.0 / 3.0))
    safe = min(safe, min(jerk / acceleration, 0.2 / period) * left)
    brake = math.inf  # what there is to slow s with
    for k in range(joints):
        d = new[2, k] - old[2, k]
        sign = 1.0 if d >= 0.0 else -1.0
        size = max(abs(d), NEGLIGIBLE)
        old_qdd = (old[2, k] - 2.0 * old[1, k] + old[0, k]) / h2
        new_qdd = (new[2, k] - 2.0 * new[1, k] + new[0, k]) / h2
        old_qd, new_qd = (old[2, k] - old[1, k]) / period, (new[2, k] - new[1, k]) / period
        # A filter whose parameters vary may exceed the reference's limits by itself.
        qdd_max = max(acceleration, abs(old_qdd), abs(new_qdd))
        qd_max = max(velocity, abs(old_qd), abs(new_qd))
        # The differences of the output are linear in s: a limit is an interval of s.
        middle = -sign * (old[2, k] - 2.0 * out[1, k] + out[0, k]) / size
        least = max(least, middle - qdd_max * h2 / size)
        most = min(most, middle + qdd_max * h2 / size)
        middle = -sign * (old[2, k] - out[1, k]) / size
        least = max(least, middle - qd_max * period / size)
        most = min(most, middle + qd_max * period / size)
        # Stopping s takes room on the far side of the motion's own acceleration. The motion may close it at the
        # jerk limit, and until then a velocity of room²/(2 jerk) can be taken back.
        qdd = share * new_qdd + left * old_qdd
        room = max((1.0 - MARGIN) * qdd_max + sign * qdd, 0.0)
        brake = min(brake, room / size)
        rest = 2.0 * STOP * left / size  # ṡ² by s̈ times size: from which s rests at 1
        slow = min(STOP * room * room / (2.0 * jerk * size), math.sqrt(rest * min(room, PUSH * acceleration)))
        if sign * (old_qd + new_qd) < 0.0:
            # The fade holds the joint back. While s goes on evenly it takes from q̈ and does no harm. It need not be
            # stopped, but then cannot be before the joint is at its highest velocity: that is to be before s is 1.
            qd = abs(share * new_qd + left * old_qd)
            if (new_qd - old_qd) * qdd <= 1e-4 * velocity * acceleration:
                until = qd * max(qd_max - qd, 1e-3 * qd_max) / (acceleration * qd_max) + NEGLIGIBLE  # [s]
                slow = max(slow, min(COAST * left / until, math.sqrt(rest * PUSH * acceleration)))
            slow = min(slow, BACK * qd / size)
        safe = min(safe, slow)
    wish = (safe - rate) / (EASE if safe > rate else period)
    slope = max(min(wish, slope + push * period), slope - jerk / widest * period)
    slope = min(slope, PUSH * acceleration / widest, 6.0 / QUICKEST**2)
    wanted = max(rate + period * slope, 0.0)
    if least > most:  # joints that want different things: none gets more than its room
        s = share + period * max(min(wanted, rate), rate - period * brake)
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
        self._limits = (float(velocity), float(acceleration), float(jerk), float(old.period))
        self._rate, self._slope = 0.0, 0.0
        self._history: Floats = np.zeros((3, 3, old.joints))
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
            q_ref: Reference x_i [rad], shape (joints,), finite.

        Returns:
            Shaped reference x*_i [rad], shape (joints,), the caller's own.

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
        else:
            self.share, self._rate, self._slope = blend(
                old, new, out, self.share, self._rate, self._slope, *self._limits
            )
        return np.array(out[2])

"""Whether a sampled signal is within the limits of velocity, acceleration and jerk, and can stay there."""

import numpy as np
import numpy.typing as npt

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.trajectory.limits import Floats

Bools = npt.NDArray[np.bool_]

FASTEST, HARDEST, HARSHEST, JERK, TOLERANCE, ROUNDING, INNER, PERIOD = range(8)
"""Places of the numbers with which `judge` compares: the largest first, second and third difference of positions; the
jerk limit as a third difference; `Limiter.TOLERANCE` and `ROUNDING`; the largest position that is far from the ends of
the range [rad]; and the tick [s].
"""
STEP, BEND, QD, QDD, DIFFERENCES = range(5)
"""Rows of differences: first and second one [rad], and as velocity and acceleration; their number."""
FIT, FAR = 1, 2
"""Bits of what `judge` returns: all joints fit; all are far from the ends of their range."""


@compiled_for_ticks
def judge(
    q: Floats,  # shape (n,) [rad]
    last: Floats,  # a tick earlier
    before: Floats,  # differences a tick earlier, shape (4, n), see `DIFFERENCES`
    most: Floats,  # what they are compared with, see `FASTEST`
    now: Floats,  # result: differences, shape (4, n)
    fits: Bools,  # result: which joints fit, shape (n,)
) -> int:
    """Find which joints' differences are and can stay within limits; return the sum of `FIT` and `FAR`."""
    fastest, jerk, h = most[FASTEST], most[JERK], most[PERIOD]
    far, free = True, True
    for j in range(q.shape[0]):
        step = q[j] - last[j]
        bend = step - before[STEP, j]
        now[STEP, j], now[BEND, j], now[QD, j], now[QDD, j] = step, bend, step / h, bend / (h * h)
        size, turn = abs(step), abs(bend)
        fits[j] = size <= fastest and turn <= most[HARDEST] and abs(bend - before[BEND, j]) <= most[HARSHEST]
        if size + turn * turn * (0.5 / jerk) > fastest:
            free = False
        if not abs(q[j]) <= most[INNER]:
            far = False
    found = FAR if far else 0
    fit = True
    for j in range(q.shape[0]):
        step, bend = now[STEP, j], now[BEND, j]
        if not free:
            # Velocity at the time when the acceleration, reduced by a tick's worth of jerk per tick, has reached
            # zero.
            turn, sign = abs(bend), np.sign(bend)
            ticks = np.floor(turn / jerk)
            towards = step * sign + ticks * (turn - 0.5 * jerk * (ticks + 1.0))
            # If the acceleration is rising, check its present value as well, since limiting would start from that.
            rise = (bend - before[BEND, j]) * sign
            present = turn + rise
            reached = step * sign + turn / 6.0 + present / 3.0 + present * present * (0.5 / jerk)
            falls = rise <= most[TOLERANCE] * jerk + 4.0 * most[ROUNDING]
            stays = falls or reached <= fastest + 2.0 * turn
            fits[j] = fits[j] and towards <= fastest + most[TOLERANCE] * turn and stays
        fit = fit and fits[j]
    return found + FIT if fit else found

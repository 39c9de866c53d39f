"""The shortest stop of one joint, in closed form and compiled, where ruckig would be called for every set-point.

It begins with a velocity v and an acceleration a, and ends at rest. Its acceleration has three phases: with the jerk
limit to its peak against the motion, constant, and with the jerk limit to zero (Berscheid and Kröger, RSS 2021).
"""

import math

from tvist_controller._compiled import compiled_for_ticks


@compiled_for_ticks
def stop_phases(v: float, a: float, limit: float, jerk: float) -> tuple[float, float, float, float, float]:
    """Return duration [s] and jerk [rad/s^3] of the first phase, the other durations, and the last phase's jerk.

    Velocity and acceleration are those at the start [rad/s, rad/s^2]; the acceleration may exceed its limit.
    """
    # Without braking, the velocity would become this while the acceleration is reduced to zero.
    left = v + 0.5 * a * abs(a) / jerk
    side = -1.0 if left > 0.0 else 1.0
    change, begin = -side * v, side * a
    peak = math.sqrt(max(jerk * change + 0.5 * begin * begin, 0.0))
    if begin > limit:
        first = -jerk
        peak, held = limit, (change - 0.5 * begin * begin / jerk) / limit
    elif peak > limit:
        first = jerk
        peak, held = limit, (change - (limit * limit - 0.5 * begin * begin) / jerk) / limit
    else:
        first, held = jerk, 0.0
    return abs(peak - begin) / jerk, side * first, max(held, 0.0), peak / jerk, -side * jerk


@compiled_for_ticks
def after(
    v: float, a: float, phases: tuple[float, float, float, float, float], time: float
) -> tuple[float, float, float]:
    """Return the turned angle [rad], velocity and acceleration at a time after the start of a stop [s]."""
    ramp, first, held, last, jerk = phases
    turned = 0.0
    for phase in range(3):
        length, rise = (ramp, first) if phase == 0 else (held, 0.0) if phase == 1 else (last, jerk)
        t = min(time, length)
        turned += t * (v + t * (0.5 * a + t * rise / 6.0))
        v, a = v + t * (a + 0.5 * t * rise), a + t * rise
        time -= t
    return turned, v, a

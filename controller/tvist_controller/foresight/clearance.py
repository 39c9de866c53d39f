"""Distances between capsules of an arm and the floor, and lower bounds while joints turn, compiled.

A capsule contains all points within its radius of its axis, a line segment. Only the joints between two
bodies change the distance between them. If joint j turns at q̇_j, the distance changes at most at |q̇_j|
times r, where r is the smaller of the bodies' largest distances from the joint: the nearest points of both
surfaces lie on a common normal, and if both points turned with the joint, their velocities along this normal
would be equal.
"""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats
from tvist_plant.chain import bend, start, step_along

LINK, FIRST, SECOND, RADIUS, BODY = 0, 1, 4, 7, 8
"""Columns of a body: number of joints before it, ends of its axis in its link's frame and radius [m]; number
of columns. The floor's row has the link `FLOOR` and its height."""
FLOOR = -1.0
ONE, OTHER, ARMS = 0, 1, 2
"""Columns of a pair: numbers of its bodies, then for each joint the bound of their approach [m/rad]."""
MAX_POSTURES = 16  # largest number of postures checked per stop


@compiled_for_ticks
def place(
    chain: Floats,  # parameters of the links, see `tvist_plant.chain`, shape (n+1, 22)
    q: Floats,
    bodies: Floats,  # see `BODY`, shape (b, 8)
    ends: Floats,  # result: both ends of each axis in the base frame, shape (b, 6) [m]
) -> None:
    """Compute the ends of the bodies' axes."""
    R, o = np.empty((3, 3)), np.empty(3)
    start(R, o)
    for link in range(q.shape[0] + 1):
        if link > 0:
            step_along(chain[link - 1], R, o)
            bend(R, q[link - 1])
        for b in range(bodies.shape[0]):
            if bodies[b, LINK] == link:
                for i in range(3):
                    for end in (FIRST, SECOND):
                        x, y, z = bodies[b, end], bodies[b, end + 1], bodies[b, end + 2]
                        ends[b, end - FIRST + i] = o[i] + (R[i, 0] * x + R[i, 1] * y + R[i, 2] * z)


@compiled_for_ticks
def gap(bodies: Floats, ends: Floats, one: int, other: int) -> float:
    """Return the distance between two bodies, the second of which may be the floor [m]."""
    p, q = ends[one], ends[other]
    if bodies[other, LINK] == FLOOR:
        return float(min(p[2], p[5]) - bodies[one, RADIUS] - bodies[other, RADIUS])
    # The nearest points of two segments, by their shares s and t.
    ux, uy, uz = p[3] - p[0], p[4] - p[1], p[5] - p[2]
    vx, vy, vz = q[3] - q[0], q[4] - q[1], q[5] - q[2]
    wx, wy, wz = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    a, b, c = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, ux * wx + uy * wy + uz * wz
    e, f = vx * vx + vy * vy + vz * vz, vx * wx + vy * wy + vz * wz
    square = a * e - b * b
    s = min(max((b * f - c * e) / square, 0.0), 1.0) if square > 0.0 else 0.0
    t = (b * s + f) / e if e > 0.0 else 0.0
    if t < 0.0 or t > 1.0 or e <= 0.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((b * t - c) / a, 0.0), 1.0) if a > 0.0 else 0.0
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return float(math.sqrt(x * x + y * y + z * z) - bodies[one, RADIUS] - bodies[other, RADIUS])


@compiled_for_ticks
def rooms(
    chain: Floats,  # for this and bodies see `place`
    bodies: Floats,
    pairs: Floats,  # see `ARMS`, shape (k, 2+n)
    ends: Floats,  # scratch, see `place`
    q: Floats,
    turned: Floats,  # largest angle of each joint; with zeros, the distances at q are computed [rad]
    found: Floats,  # result of each pair, shape (k,) [m]
) -> float:
    """Compute lower bounds of all pairs' distances while joints turn; return the smallest [m]."""
    place(chain, q, bodies, ends)
    least = math.inf
    for p in range(pairs.shape[0]):
        way = 0.0
        for j in range(q.shape[0]):
            way += pairs[p, ARMS + j] * turned[j]
        found[p] = gap(bodies, ends, int(pairs[p, ONE]), int(pairs[p, OTHER])) - way
        # A non-finite posture is never clear.
        least = min(least, found[p]) if math.isfinite(found[p]) else -math.inf
    return least


@compiled_for_ticks
def stop_has_room(
    chain: Floats,  # for this and the next three see `rooms`
    bodies: Floats,
    pairs: Floats,
    ends: Floats,
    q: Floats,  # state at its start
    qd: Floats,
    qdd: Floats,
    limit: float,  # acceleration of every joint [rad/s^2]
    jerk: float,  # likewise [rad/s^3]
    least: float,
) -> bool:
    """Return whether all bodies certainly stay more than `least` [m] apart during a stop.

    After each checked posture, time advances by the shortest time in which two bodies could come that close.
    """
    n, time = q.shape[0], 0.0
    now, fastest, left = np.empty(n), np.empty(n), np.empty(n)
    waiting = np.arange(pairs.shape[0])  # pairs that are not known to stay apart until the end
    count = waiting.shape[0]
    for _ in range(MAX_POSTURES):
        for j in range(n):
            phases = stop_phases(qd[j], qdd[j], limit, jerk)
            turned, v, a = after(qd[j], qdd[j], phases, time)
            rest = max(phases[0] + phases[2] + phases[3] - time, 0.0)
            now[j] = q[j] + turned
            # Until the acceleration is reduced to zero, the velocity grows by no more than this.
            fastest[j] = abs(v) + 0.5 * a * a / jerk if rest > 0.0 else 0.0
            left[j] = fastest[j] * min(rest, 0.5 * fastest[j] / limit + (limit + abs(a)) / jerk)
        place(chain, now, bodies, ends)
        step, looked, count = math.inf, count, 0
        for number in range(looked):
            p = waiting[number]
            way = speed = 0.0
            for j in range(n):
                way += pairs[p, ARMS + j] * left[j]
                speed += pairs[p, ARMS + j] * fastest[j]
            room = gap(bodies, ends, int(pairs[p, ONE]), int(pairs[p, OTHER])) - least
            if not room > 0.0:  # negated, so that NaN is never clear
                return False
            if not room > way:
                waiting[count] = p
                count += 1
                step = min(step, room / speed)
        if count == 0:
            return True
        time += step
    return False


# The shortest stop of one joint in closed form, where ruckig would be called for every set-point. It begins with a
# velocity v and an acceleration a, and ends at rest. Its acceleration has three phases: with the jerk limit to its peak
# against the motion, constant, and with the jerk limit to zero (Berscheid and Kröger, RSS 2021).


@compiled_for_ticks
def stop_phases(v: float, a: float, limit: float, jerk: float) -> tuple[float, float, float, float, float]:
    """Return the phases of a stop: durations [s] and jerks [rad/s^3].

    Order: first phase, first jerk, middle phase, last phase, last jerk. The initial acceleration may
    exceed its limit.
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
    """Return turned angle [rad], velocity and acceleration at `time` [s] after the start of a stop."""
    ramp, first, held, last, jerk = phases
    turned = 0.0
    for phase in range(3):
        length, rise = (ramp, first) if phase == 0 else (held, 0.0) if phase == 1 else (last, jerk)
        t = min(time, length)
        turned += t * (v + t * (0.5 * a + t * rise / 6.0))
        v, a = v + t * (a + 0.5 * t * rise), a + t * rise
        time -= t
    return turned, v, a

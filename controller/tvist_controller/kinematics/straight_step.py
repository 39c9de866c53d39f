"""One tick of a tool that goes straight: the joints that follow it within their limits, compiled."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.pose import locate, newton, pseudo_inverse
from tvist_controller.kinematics.rotation import turn_into
from tvist_plant.model import Floats

FOUND, IMPOSSIBLE, SINGULAR = 0, 1, 2

BENT_SHARE = 0.5
"""Share of the joints' acceleration that the curvature of their way may use up at a constant speed [-]."""
MORE = 1e-6
"""Share by which rounding may exceed a limit [-]."""
LOOK = 5.0
"""Ticks over which that curvature is measured, ahead of the tool."""
FARTHEST_LOOK = 0.05
"""Largest angle of a joint over which it is measured [rad]."""
SLOWEST = 0.01
"""Share of the commanded speed below which the tool counts as stuck [-]."""
CORRECTIONS = 4
"""Largest number of Newton's steps."""
OFF = 1e-7
"""Error of the tool's pose that is not permitted [m or rad]."""
FLAT = 1e-12
"""Factor of a rate that counts as zero."""


@compiled_for_ticks
def rates_within(x: Floats, y: Floats, low: Floats, high: Floats) -> tuple[float, float]:
    """Return what `tvist_controller.trajectory.speed.fitting_rates` does."""
    lowest, highest = -math.inf, math.inf
    for i in range(len(x)):
        if abs(y[i]) < FLAT:
            if not low[i] <= x[i] <= high[i]:
                return math.inf, -math.inf
            continue
        one, other = (low[i] - x[i]) / y[i], (high[i] - x[i]) / y[i]
        lowest, highest = max(lowest, min(one, other)), min(highest, max(one, other))
    return lowest, highest


@compiled_for_ticks
def straight_step(  # noqa: C901  a kernel: its branches are loops
    chain: Floats, inverse: Floats,
    joints: Floats, twists: Floats, ranges: Floats, change: Floats,
    rate: float, speed: float, slowest: float, acceleration: float, h: float,
    rotation: Floats, position: Floats, goal_rotation: Floats, goal_position: Floats, q: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Follow the mean of two twists for a tick, at the rate that the joints' limits and the way's curvature permit.

    Args:
        chain: The links, the tool centre point being their end.
        inverse: Pseudo-inverse of the Jacobian in the middle of the tick, shape (n, 6).
        joints: Present positions [rad] and the step to them [rad], shape (2, n).
        twists: Twist at the beginning and at the end, in the trajectory's own time, shape (2, 6).
        ranges: Least and largest change of the joints' step, and largest step, shape (3, n) [rad].
        change: Largest change of the twist, shape (6,).
        rate: Present rate of that time [-].
        speed: Commanded rate [-].
        slowest: Velocity limit of the joints [rad/s].
        acceleration: Acceleration limit of the joints [rad/s^2].
        h: Tick [s].
        rotation: Present rotation of the tool, shape (3, 3).
        position: Present position of the tool, shape (3,) [m].
        goal_rotation: Result: its rotation a tick later, shape (3, 3).
        goal_position: Result: its position a tick later, shape (3,) [m].
        q: Result: positions of the joints a tick later, shape (n,) [rad].

    Returns:
        FOUND; IMPOSSIBLE if the limits do not permit it; or SINGULAR if the curvature permits next to no speed. And the
        rate at the end.
    """
    n = len(q)
    present, u = twists[0], twists[1]
    before, slope = np.zeros(n), np.zeros(n)
    for i in range(n):
        for m in range(6):
            before[i] += inverse[i, m] * (0.5 * h * rate * present[m])
            slope[i] += inverse[i, m] * u[m]
    after = 0.5 * h * slope
    lowest, highest = rates_within(before - joints[1], after, ranges[0], ranges[1])
    if lowest > min(highest, max(rate, speed)) or highest < 0.0:
        return IMPOSSIBLE, rate
    least, most = rates_within(-rate * present, u, -change, change)
    wanted = min(max(speed, least), most)
    jacobian, turned, place = np.empty((6, n)), np.empty((3, 3)), np.empty(3)
    fastest = np.max(np.abs(slope))
    if fastest > 0.0:
        # Near a singular posture the joints' way bends: its second derivative times the speed squared accelerates them.
        ahead = min(LOOK * h * max(wanted, SLOWEST), FARTHEST_LOOK / fastest)
        locate(chain, joints[0] + ahead * slope, turned, place, jacobian)
        there = np.empty((n, 6))
        pseudo_inverse(jacobian, there)
        bend = 1e-9
        for i in range(n):
            later = 0.0
            for m in range(6):
                later += there[i, m] * u[m]
            bend = max(bend, abs(later - slope[i]) / ahead)
            fastest = max(fastest, abs(later))
        permitted = min(math.sqrt(BENT_SHARE * acceleration / bend), slowest / fastest)
        if permitted < SLOWEST:
            return SINGULAR, rate
        wanted = min(wanted, permitted)
    new = max(min(wanted, highest), lowest, 0.0)
    mean = 0.5 * h * (rate * present + new * u)
    goal_position[:] = position + mean[:3]
    turn_into(mean[3:], rotation, goal_rotation)
    q[:] = joints[0] + before + new * after
    if not newton(chain, goal_rotation, goal_position, inverse, CORRECTIONS, q, np.empty(6)) <= OFF:
        return IMPOSSIBLE, rate
    for i in range(n):
        step = q[i] - joints[0, i]
        bent = abs(step - joints[1, i]) > (1.0 + MORE) * h * h * acceleration
        if bent or abs(step) > (1.0 + MORE) * ranges[2, i]:
            return IMPOSSIBLE, rate
    return FOUND, new

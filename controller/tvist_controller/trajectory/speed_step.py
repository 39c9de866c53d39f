"""One tick of joints, or of a tool that moves straight: joint positions within their limits, compiled."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.pose import locate, newton, pseudo_inverse, turn_into
from tvist_kernels.compiling import inlined
from tvist_plant.model import Floats

FOUND, IMPOSSIBLE, SINGULAR = 0, 1, 2

BENT_SHARE = 0.5
"""Fraction of joint acceleration available to the curvature of the joints' path at constant speed [-]."""
MORE = 1e-6  # relative excess of a limit that counts as rounding [-]
LOOK = 5.0  # ticks ahead over which the curvature is measured
FARTHEST_LOOK = 0.05  # largest joint angle over which it is measured [rad]
SLOWEST = 0.01  # fraction of the commanded speed below which the tool is stuck [-]
CORRECTIONS = 4  # largest number of Newton steps
OFF = 1e-7  # permitted error of the tool's pose [m or rad]
FLAT = 1e-12  # factor of a rate treated as zero


@compiled_for_ticks
def fitting_rates(x: Floats, y: Floats, low: Floats, high: Floats) -> tuple[float, float]:
    """Return the range of r with low ≤ x + r y ≤ high everywhere; the first is larger if there is none."""
    lowest, highest = -math.inf, math.inf
    for i in range(len(x)):
        if abs(y[i]) < FLAT:
            if not low[i] <= x[i] <= high[i]:
                return math.inf, -math.inf
            continue
        one, other = (low[i] - x[i]) / y[i], (high[i] - x[i]) / y[i]
        lowest, highest = max(lowest, min(one, other)), min(highest, max(one, other))
    return lowest, highest


@inlined
def rate_by_bend(
    chain: Floats, q: Floats, slope: Floats, u: Floats, ahead: float, acceleration: float
) -> float:
    """Return the rate that path curvature permits; `slope` becomes the larger of now and ahead.

    Near a singular posture the joints' path bends: its second derivative times squared speed is acceleration.
    """
    n = len(q)
    jacobian, inverse, later_q = np.empty((6, n)), np.empty((n, 6)), np.empty(n)
    for i in range(n):
        later_q[i] = q[i] + ahead * slope[i]
    locate(chain, later_q, np.empty((3, 3)), np.empty(3), jacobian)
    pseudo_inverse(jacobian, inverse)
    bend = 1e-9
    for i in range(n):
        later = 0.0
        for m in range(6):
            later += inverse[i, m] * u[m]
        bend = max(bend, abs(later - slope[i]) / ahead)
        slope[i] = max(abs(slope[i]), abs(later))
    return math.sqrt(BENT_SHARE * acceleration / bend)


@compiled_for_ticks
def speed_step(  # noqa: C901, PLR0912  a kernel: its branches are loops
    chain: Floats,  # to the tool centre point; no links if the velocities are those of the joints
    inverse: Floats,  # pseudo-inverse of the Jacobian in mid-tick, shape (n, 6); else the unit matrix
    joints: Floats,  # present positions [rad] and the step to them [rad], shape (2, n)
    velocities: Floats,  # at the beginning and the end, in the trajectory's own time, shape (2, 6) or (2, n)
    ranges: Floats,  # least and largest change of the joints' step, and largest step, shape (3, n) [rad]
    change: Floats,  # largest one of the velocity, shape (6,) or (n,)
    given: Floats,  # present and wanted rate [-], the joints' limits, `Speed._lag`, tick [s]
    place: Floats,  # present rotation and position of the tool, shape (4, 3)
    goal: Floats,  # result: those a tick later
    q: Floats,  # result: positions of the joints a tick later, shape (n,) [rad]
) -> tuple[int, float]:
    """Follow the mean of two velocities for a tick, at the rate that joint limits and curvature permit.

    Returns FOUND and the final rate; or IMPOSSIBLE due to limits; or SINGULAR if curvature permits hardly any speed.
    """
    rate, speed, slowest, acceleration, lag, h = given[0], given[1], given[2], given[3], given[4], given[5]
    n, straight = len(q), chain.shape[0] > 0
    present, u = velocities[0], velocities[1]
    before, slope, after = np.zeros(n), np.zeros(n), np.empty(n)
    gained, kept, lost, fastest, sharpest = np.empty(n), np.empty(len(u)), np.empty(len(u)), 0.0, 0.0
    for i in range(n):
        for m in range(len(u)):
            before[i] += inverse[i, m] * (0.5 * h * rate * present[m])
            slope[i] += inverse[i, m] * u[m]
        after[i], gained[i] = 0.5 * h * slope[i], before[i] - joints[1, i]
        fastest = max(fastest, abs(slope[i]))
    for m in range(len(u)):
        kept[m], lost[m], sharpest = -rate * present[m], -change[m], max(sharpest, change[m])
    lowest, highest = fitting_rates(gained, after, ranges[0], ranges[1])
    if not straight and sharpest == 0.0:
        lowest = highest = rate  # joints may always keep their velocities
    if lowest > min(highest, max(rate, speed)) or highest < 0.0:
        return IMPOSSIBLE, rate
    least, most = fitting_rates(kept, u, lost, change)
    wanted = speed
    if wanted != rate:  # the present rate is possible, but for rounding
        wanted = min(max(wanted, least), most)
    if straight and fastest > 0.0:
        ahead = min(LOOK * h * max(wanted, SLOWEST), FARTHEST_LOOK / fastest)
        permitted = rate_by_bend(chain, joints[0], slope, u, ahead, acceleration)
        for i in range(n):
            fastest = max(fastest, slope[i])
        permitted = min(permitted, slowest / fastest)
        if permitted < SLOWEST:
            return SINGULAR, rate
        wanted = min(wanted, permitted)
    new = max(min(wanted, highest), lowest, 0.0)
    for i in range(n):
        q[i] = joints[0, i] + before[i] + new * after[i]
    if straight:
        mean = np.empty(6)
        for m in range(6):
            mean[m] = 0.5 * h * (rate * present[m] + new * u[m])
        for k in range(3):
            goal[3, k] = place[3, k] + mean[k]
        turn_into(mean[3:], place[:3], goal[:3])
        if not newton(chain, goal[:3], goal[3], inverse, CORRECTIONS, q, np.empty(6)) <= OFF:
            return IMPOSSIBLE, rate
    for i in range(n):
        step = q[i] - joints[0, i]
        bent = abs(step - joints[1, i]) > (1.0 + MORE) * lag * acceleration
        if bent or abs(step) > (1.0 + MORE) * ranges[2, i]:
            return IMPOSSIBLE, rate
    return FOUND, new

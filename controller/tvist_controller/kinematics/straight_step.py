"""One tick of a tool that goes straight: the joints that follow it within their limits, compiled."""

import math

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.kinematics.denavit_hartenberg import Floats, kinematics_into
from tvist_controller.kinematics.least_squares import pose_error

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
LOST = 1e-4
"""Singular value of the Jacobian below which the joints cannot move the tool in its direction [m or rad per rad]."""
SWEEPS = 15
"""Largest number of sweeps over all pairs of the Jacobian's rows; seven are enough for any that was tried."""
CORRECTIONS = 4
"""Largest number of Newton steps with a kept Jacobian."""
ACCURATE = 1e-11
"""Error of the tool's pose at which they end [m or rad]."""
OFF = 1e-7
"""Error of the tool's pose that is not permitted [m or rad]."""
FLAT = 1e-12
"""Factor of a rate that counts as zero."""


@compiled_for_ticks
def pseudo_inverse(jacobian: Floats, inverse: Floats) -> None:  # noqa: C901, PLR0912  a kernel: its branches are loops
    """Compute the pseudo-inverse of a Jacobian without its lost directions, by one-sided Jacobi rotations.

    numba's own decomposition needs scipy, which a served robot does without (Hestenes, 1958).

    Args:
        jacobian: Jacobian, shape (6, n).
        inverse: Result, shape (n, 6).
    """
    n = jacobian.shape[1]
    W, V = jacobian.copy(), np.eye(6)
    for _ in range(SWEEPS):
        turned = False
        for i in range(5):
            for j in range(i + 1, 6):
                a, b, c = 0.0, 0.0, 0.0
                for k in range(n):
                    a, b, c = a + W[i, k] * W[i, k], b + W[j, k] * W[j, k], c + W[i, k] * W[j, k]
                if c * c <= 1e-28 * a * b or min(a, b) < 1e-20:
                    continue
                turned = True
                zeta = (b - a) / (2.0 * c)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / math.sqrt(1.0 + t * t)
                sine = cosine * t
                for k in range(n):
                    W[i, k], W[j, k] = cosine * W[i, k] - sine * W[j, k], sine * W[i, k] + cosine * W[j, k]
                for k in range(6):
                    V[i, k], V[j, k] = cosine * V[i, k] - sine * V[j, k], sine * V[i, k] + cosine * V[j, k]
        if not turned:
            break
    inverse[:] = 0.0
    for i in range(6):
        square = 0.0
        for k in range(n):
            square += W[i, k] * W[i, k]
        if square > LOST * LOST:
            for k in range(n):
                for m in range(6):
                    inverse[k, m] += W[i, k] * V[i, m] / square


@compiled_for_ticks
def turn_into(angle: Floats, rotation: Floats, result: Floats) -> None:
    """Turn a rotation matrix about the base frame's axes by a rotation vector, shape (3,) [rad] (Rodrigues)."""
    x, y, z = angle[0], angle[1], angle[2]
    size = math.sqrt(x * x + y * y + z * z)
    s = math.sin(size) / size if size > 1e-8 else 1.0
    half = math.sin(0.5 * size) / size if size > 1e-8 else 0.5
    c = 2.0 * half * half
    for k in range(3):
        a, b, d = rotation[0, k], rotation[1, k], rotation[2, k]
        u, v, w = y * d - z * b, z * a - x * d, x * b - y * a
        result[0, k] = a + s * u + c * (y * w - z * v)
        result[1, k] = b + s * v + c * (z * u - x * w)
        result[2, k] = d + s * w + c * (x * v - y * u)


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
def straight_step(  # noqa: C901, PLR0912  a kernel: its branches are loops
    dh: Floats, tool_rotation: Floats, tool_position: Floats, inverse: Floats,
    joints: Floats, twists: Floats, ranges: Floats, change: Floats,
    rate: float, speed: float, slowest: float, acceleration: float, h: float,
    rotation: Floats, position: Floats, goal_rotation: Floats, goal_position: Floats, q: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Follow the mean of two twists for a tick, at the rate that the joints' limits and the way's curvature permit.

    Args:
        dh: Table of `dh_table`.
        tool_rotation: Rotation of the tool in the flange frame, shape (3, 3).
        tool_position: Tool centre point in the flange frame, shape (3,) [m].
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
        kinematics_into(dh, tool_rotation, tool_position, joints[0] + ahead * slope, turned, place, jacobian)
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
    error = np.empty(6)
    off = math.inf
    for correction in range(CORRECTIONS + 1):
        kinematics_into(dh, tool_rotation, tool_position, q, turned, place, jacobian)
        pose_error(goal_rotation, goal_position, turned, place, error)
        off = np.max(np.abs(error))
        if off <= ACCURATE or correction == CORRECTIONS:
            break
        for i in range(n):
            for m in range(6):
                q[i] += inverse[i, m] * error[m]
    if not off <= OFF:
        return IMPOSSIBLE, rate
    for i in range(n):
        step = q[i] - joints[0, i]
        bent = abs(step - joints[1, i]) > (1.0 + MORE) * h * h * acceleration
        if bent or abs(step) > (1.0 + MORE) * ranges[2, i]:
            return IMPOSSIBLE, rate
    return FOUND, new

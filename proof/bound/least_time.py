"""The least time in which a straight line in joint space can end without vibration, without feed-forward.

The way s(t) goes from 0 to 1 and from rest to rest. Its jerk is constant in each tick, and |ṡ|, |s̈| and |s⃛| keep the
limits that the joints' limits imply. Each mode, frozen at the end pose, is

    ẍ + 2 ζ ω ẋ + ω² x = -s̈,

and x = ẋ = 0 in the end, which is an integral of s̈ for each pole and does not depend on how much a mode is excited. T
is the least number of ticks for which this is possible. The bound is T less the least time without any mode.
"""

from collections.abc import Callable

import numpy as np

from tvist_controller.api.line import JointLine, MotionLimits, Programme, inside, optimize, quickest_motion
from tvist_lab.recordings import Floats
from tvist_plant.plant import PERIOD

MODES = 4
"""Number of modes that are at rest in the end."""
INDEPENDENT = 1e-10
"""Smallest singular value of the modes' equations, relative to the largest: a double mode has one less."""
SLACK = 1e-7
"""Share of the way by which the solver may miss it [-]."""


def way_of(start: Floats, target: Floats) -> float:
    """Way of the joint that turns most [rad]; the joints' limits are those of this way."""
    return float(np.abs(target - start).max())


def poles_of(f_d: Floats, zeta: Floats) -> Floats:
    """Poles of modes [1/s], shape (k, 2): real and imaginary part."""
    omega = 2.0 * np.pi * f_d
    return np.column_stack((-omega * zeta / np.sqrt(1.0 - zeta**2), omega))


def bound(start: Floats, target: Floats, limits: MotionLimits, f_d: Floats, zeta: Floats) -> float:
    """Extra time that a motion needs to end without vibration [s].

    Args:
        start: Joint angles at the start, shape (n,) [rad].
        target: Joint angles at the end, shape (n,) [rad].
        limits: Limits of every joint.
        f_d: Damped frequencies of the modes at the end [Hz], shape (k,).
        zeta: Damping ratios, shape (k,).
    """
    way, none = way_of(start, target), np.zeros((0, 2))
    quickest = quickest_motion(JointLine(start, target), limits, PERIOD).duration
    least = least_ticks(way, limits, none, int(quickest / PERIOD) - 2)
    return PERIOD * (least_ticks(way, limits, poles_of(f_d, zeta), least) - least)


def least_ticks(way: float, limits: MotionLimits, poles: Floats, enough: int) -> int:
    """Least number of ticks of a motion that leaves these modes at rest.

    Args:
        way: Way of the motion [rad].
        limits: Its limits.
        poles: Poles of the modes, as in `poles_of`.
        enough: Number of ticks with which it can at most just be made.
    """
    return fewest(max(enough, 3), lambda ticks: farthest(ticks, limits, poles) >= way * (1.0 - SLACK))


def fewest(ticks: int, suffice: Callable[[int], bool]) -> int:
    """Least number of ticks that suffices, from one that at most just does; more than enough suffice as well."""
    low, more = ticks, 4
    while not suffice(low + more):
        low, more = low + more, 2 * more
    high = low + more
    if suffice(low):
        return low
    while high - low > 1:
        middle = (low + high) // 2
        if suffice(middle):
            high = middle
        else:
            low = middle
    return high


def farthest(ticks: int, limits: MotionLimits, poles: Floats) -> float:
    """Longest way of a motion from rest to rest in a number of ticks that leaves modes at rest [rad].

    This is a linear programme. The velocity's coefficients as a B-spline keep its limit, which is that of all samples
    of the velocity but for parts of a tick.
    """
    velocity, first = limits.velocity, limits.acceleration * PERIOD / limits.velocity
    second, unknowns = limits.jerk * PERIOD**2 / limits.velocity, ticks - 2
    rows = _equations(ticks, poles)
    none = np.zeros(len(rows))
    programme = Programme(-np.ones(unknowns), -1.0, first, second, rows, none, none)
    c = inside(unknowns, first, second)
    if not optimize(programme, c):
        return 0.0
    return float(c.sum()) * velocity * PERIOD


def _equations(ticks: int, poles: Floats) -> Floats:
    """Rows of ∫ s̈ exp(p (T - t)) dt = 0, exact for accelerations that are linear in each tick, as independent rows."""
    time = PERIOD * np.arange(ticks - 1, 0, -1)
    decay = np.exp((poles[:, :1] + 1j * poles[:, 1:]) * time)
    steps = decay[:, :-1] - decay[:, 1:]
    rows = np.concatenate((steps.real, steps.imag))
    if not len(rows):
        return rows
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    _, sizes, right = np.linalg.svd(rows, full_matrices=False)
    independent: Floats = np.ascontiguousarray(right[sizes > INDEPENDENT * sizes[0]])
    return independent

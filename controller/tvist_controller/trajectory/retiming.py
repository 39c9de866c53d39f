"""Time laws along curves with varying limits: the quickest with bounded jerk.

In the phase plane of s and b = ṡ², constant acceleration is a straight line, db/ds = 2 s̈. A backward and a
forward pass through the curve's cells find the largest permitted b (Bobrow, Dubowsky and Gibson 1985, with
bounds independent of the sign of s̈). This motion's acceleration has steps; the moving mean of s(t) over
`ramp` seconds has bounded jerk.

This mean, and any shaper behind it, mixes moments of the motion and so passes a place at speeds of its neighbourhood.
Joint limits in a cell therefore hold for all cells passed within a time window.
"""

from bisect import bisect_right
from dataclasses import dataclass, replace

import numpy as np

from tvist_controller._compiled import compiled
from tvist_controller.trajectory.base import Floats, MotionLimits, TimeLaw

TOOL_SHARE = 0.25
"""Fraction of the shaper's window for which tool limits hold [-]. The speed changes so little within it that the shaped
tool exceeds its acceleration in a bend by a hundredth; the whole window would cost half a second on some bends."""
MIN_DIVISOR = 1e-9  # smallest divisor
ROUNDS = 3  # rounds of applying windowed limits to a motion, an odd number
ROUNDING = 1e-9  # relative excess of a limit that counts as rounding [-]
AT_REST: Floats = np.zeros(1)  # known ṡ² of a motion from rest
SHORTLY = 1e-9  # time offset from a change of acceleration, to evaluate the acceleration beside the step [s]


@dataclass(frozen=True)
class Cells:
    """Limits along a curve, constant per cell: ṡ ≤ fastest, and p |s̈| + q ṡ² ≤ 1 for each of r rows."""

    fastest: Floats  # largest ṡ per cell, shape (c,) [1/s]
    p: Floats  # shape (c, r) [s^2 per unit of s]
    q: Floats  # shape (c, r) [s^2 per unit of s, squared]


@dataclass(frozen=True)
class RetimingLimits:
    """All limits of a motion along a curve."""

    edges: Floats  # cell boundaries, rising from 0, shape (c + 1,)
    joints: Cells  # joint limits, which the shaped motion also keeps
    tool: Cells  # tool limits, which the shaped motion may exceed slightly
    slope: Floats  # bound of any joint's |dq/ds| per cell, shape (c,)
    jerk: float  # joint jerk available for changes of s̈ [rad/s^3]


@compiled
def forward_backward_pass(
    edges: Floats, highest: Floats, p: Floats, q: Floats, known: Floats
) -> Floats:  # pragma: no cover  compiled
    """Return the largest b = ṡ² at the c + 1 edges, zero at the last; `p` and `q` as in `Cells`.

    `highest` is the largest b per cell. The first edges keep their `known` values, shape (k,): just 0 from rest.
    """
    count, rows = p.shape
    begun = len(known)
    b = np.zeros(count + 1)
    for number in range(begun):
        b[number] = known[number]
    for number in range(begun, count):
        b[number] = min(highest[number - 1], highest[number])
    for number in range(count - 1, begun - 1, -1):
        twice = 2.0 * (edges[number + 1] - edges[number])
        for row in range(rows):
            share = p[number, row] / twice
            if share + q[number, row] > 0.0:
                b[number] = min(b[number], (1.0 + share * b[number + 1]) / (share + q[number, row]))
    for number in range(begun - 1, count):
        twice = 2.0 * (edges[number + 1] - edges[number])
        for row in range(rows):
            share = p[number, row] / twice
            if share + q[number, row] > 0.0:
                b[number + 1] = min(b[number + 1], (1.0 + share * b[number]) / (share + q[number, row]))
    return b


@compiled
def window_max(
    times: Floats, window: float, values: Floats, lowest: bool
) -> Floats:  # pragma: no cover  compiled
    """Return for each cell the largest (or lowest) value of all cells passed within ± `window` [s].

    `times` are those at the edges, shape (c + 1,) [s]; `values` has a row per cell, shape (c, r).
    """
    count, rows = values.shape
    out = values.copy()
    first, last = 0, 0
    for number in range(count):
        while times[first + 1] < times[number] - window:
            first += 1
        while last < count - 1 and times[last + 1] <= times[number + 1] + window:
            last += 1
        for other in range(first, last + 1):
            for row in range(rows):
                if (values[other, row] < out[number, row]) == lowest:
                    out[number, row] = values[other, row]
    return out


@compiled
def flatten_peaks(edges: Floats, b: Floats, ramp: float, known: int) -> Floats:  # pragma: no cover  compiled
    """Insert constant speed for `ramp` [s] between acceleration and braking, which halves the jerk there.

    Nothing changes up to edge `known`; if the motion brakes there, it first keeps its speed. `b` is ṡ² at the
    edges.
    """
    out, last = b.copy(), len(b) - 1
    number = known + 1
    if known > 0 and b[known] < b[known - 1]:
        way = np.sqrt(b[known]) * ramp
        while number < last and edges[number] - edges[known] < way:
            out[number] = min(out[number], b[known])
            number += 1
    for top in range(known + 1, last):
        if out[top] < out[top - 1] or out[top] <= out[top + 1]:
            continue
        low, high = top - 1, top + 1  # `top` is the last of the highest edges, of which there may be several
        most = max(out[low], out[high])
        while most > 0.0 and edges[high] - edges[low] < np.sqrt(most) * ramp:
            if low > known and (out[low] >= out[high] or high == last):
                low -= 1
            elif high < last:
                high += 1
            else:
                break
            if max(out[low], out[high]) <= 0.0:  # the whole motion is no longer than a ramp
                break
            most = max(out[low], out[high])
        for number in range(low + 1, high):
            out[number] = min(out[number], most) if most > 0.0 else out[number]
    return out


class RetimedLaw(TimeLaw):
    """Time law of a curve's parameter: moving mean over `ramp` seconds of a motion with stepped acceleration.

    Before the mean, acceleration changes only at the edges (c + 1,). There ṡ² is `b`, which is 0 at the last
    edge and may be 0 at the first. `rate` > 0 is the time rate. `start` is the time at the first edge, before
    the mean and at rate 1 [s]; if `b` is not 0 there, the mean is known only `ramp` seconds later.
    """

    def __init__(self, edges: Floats, b: Floats, ramp: float, rate: float = 1.0, start: float = 0.0) -> None:
        self.edges, self.b = edges, b
        """Places where acceleration may change, and ṡ² there, each of shape (c + 1,)."""
        self.ramp, self.rate = ramp, rate  # Averaging time at rate 1 [s], and time rate [-]
        speeds, times = np.sqrt(b), start + arrivals(edges, b)
        self.times: Floats = times  # times at the edges before the mean, at rate 1, shape (c + 1,) [s]
        spans, here = np.diff(times), edges - edges[0]
        accelerations = 0.5 * np.diff(b) / np.diff(edges)
        areas = np.cumsum(spans * (here[:-1] + spans * (speeds[:-1] / 2.0 + spans * accelerations / 6.0)))
        # Motion before averaging: integral of s, s, ṡ and s̈ at the start of each cell; at rest before the first and
        # after the last.
        self._times = np.concatenate(([-np.inf], times))
        self._begun = np.concatenate(([start], times))
        self._pieces = np.zeros((4, len(edges) + 1))
        self._pieces[:, 1:-1] = np.concatenate(([0.0], areas[:-1])), here[:-1], speeds[:-1], accelerations
        self._pieces[:2, -1] = areas[-1], here[-1]
        self._origin = float(edges[0])
        self._rows = list(zip(self._begun.tolist(), *self._pieces.tolist(), strict=True))
        self._starts = self._times.tolist()
        self.duration = float(times[-1] + ramp) / rate  # duration from rest to rest [s]
        self.begins = 0.0 if b[0] == 0.0 else (start + ramp) / rate  # time from which the law is known [s]
        braking = int(np.flatnonzero(accelerations < 0.0)[0])
        self.brakes_at = float(times[braking]) / rate  # time at which the motion starts braking [s]
        # each edge, half a ramp and a ramp later
        self.moments = np.concatenate((times, times + 0.5 * ramp, times + ramp)) / rate
        changes = np.concatenate((times + SHORTLY, times + ramp - SHORTLY))
        changes = changes if b[0] == 0.0 else changes[changes >= start + ramp]
        jerk = (
            float(np.abs(self._before(changes)[3] - self._before(changes - ramp)[3]).max(initial=0.0)) / ramp
        )
        most = float(np.abs(accelerations).max())
        self.limits = MotionLimits(float(speeds.max()) * rate, most * rate**2, jerk * rate**3)

    def slowed(self, duration: float) -> "RetimedLaw":
        """Return the law stretched to a longer duration [s]."""
        if duration <= self.duration:
            return self
        return RetimedLaw(self.edges, self.b, self.ramp, self.rate * self.duration / duration)

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Return the parameter, its velocity [1/s] and its acceleration [1/s^2] at a time [s]."""
        rate, ramp = self.rate, self.ramp
        late, early = self._moment(time * rate), self._moment(time * rate - ramp)
        s, sd, sdd = ((after - before) / ramp for after, before in zip(late, early, strict=True))
        return [self._origin + s], [sd * rate], [sdd * rate * rate]

    def states(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Evaluate `at` at k times [s]; each result has shape (k,)."""
        rate, ramp = self.rate, self.ramp
        s, sd, sdd = (self._before(times * rate) - self._before(times * rate - ramp))[:3] / ramp
        return self._origin + s, sd * rate, sdd * rate**2

    def _moment(self, time: float) -> tuple[float, float, float]:
        begun, area, s, sd, sdd = self._rows[bisect_right(self._starts, time) - 1]
        t = time - begun
        return area + t * (s + t * (sd / 2.0 + t * sdd / 6.0)), s + t * (sd + 0.5 * t * sdd), sd + t * sdd

    def _before(self, times: Floats) -> Floats:
        """Return ∫s, s, ṡ and s̈ of the motion before the mean, shape (4, k)."""
        numbers = np.searchsorted(self._times, times, side="right") - 1
        t = times - self._begun[numbers]
        area, s, sd, sdd = self._pieces[:, numbers]
        return np.array(
            (area + t * (s + t * (sd / 2.0 + t * sdd / 6.0)), s + t * (sd + 0.5 * t * sdd), sd + t * sdd, sdd)
        )


def arrivals(edges: Floats, b: Floats) -> Floats:
    """Return the times at cell edges, shape (c + 1,) [s]; arguments as in `RetimedLaw`."""
    speeds = np.sqrt(b)
    return np.concatenate(([0.0], np.cumsum(2.0 * np.diff(edges) / (speeds[:-1] + speeds[1:]))))


def quickest_law(way: RetimingLimits, jerk: float, window: float, *, goes_on: bool = False) -> RetimedLaw:
    """Return the quickest law within the limits along a curve.

    `jerk` limits s [1/s^3]. `window` is the time over which a shaper mixes moments of the motion [s]. If
    `goes_on`, the law can be extended by `longer_law`, which keeps its ramp.
    """
    lengths = np.diff(way.edges)
    b = _passed(way.edges, way.joints, way.tool, AT_REST)
    accelerations = np.abs(0.5 * np.diff(b) / lengths)
    ramp = float(max(accelerations.max() / jerk, (way.slope * accelerations).max() / way.jerk))
    b = _lastingly(way, b, ramp, window, AT_REST)
    law = RetimedLaw(way.edges, flatten_peaks(way.edges, b, ramp, 0) if goes_on else b, ramp)
    if law.limits.jerk > jerk * (1.0 + 1e-6):  # the law goes from acceleration to braking within a ramp
        ramp *= law.limits.jerk / jerk
        law = RetimedLaw(way.edges, _lastingly(way, b, ramp, window, AT_REST), ramp)
    return law


def longer_law(
    way: RetimingLimits, jerk: float, window: float, before: RetimedLaw, first: int, known: int
) -> RetimedLaw | None:
    """Return the quickest law that equals the law `before` up to an edge, and continues behind its end.

    The way begins at edge `first` of `before`. Both laws have the same ramp and are equal up to the way's
    edge `known`; None if the limits cannot be kept from there. For `jerk` and `window` see `quickest_law`.
    """
    fixed, ramp, start = before.b[first : first + known + 1], before.ramp, float(before.times[first])
    # The ramp is fixed, so limit the acceleration to keep the jerk.
    joints = replace(way.joints, p=np.maximum(way.joints.p, way.slope[:, None] / (way.jerk * ramp)))
    tool = replace(way.tool, p=np.maximum(way.tool.p, 1.0 / (jerk * ramp)))
    way = replace(way, joints=joints, tool=tool)
    b = _lastingly(way, _passed(way.edges, joints, tool, fixed), ramp, window, fixed)
    b = flatten_peaks(way.edges, b, ramp, known)
    return RetimedLaw(way.edges, b, ramp, before.rate, start) if _goes_on(way, b, known) else None


def _lastingly(way: RetimingLimits, b: Floats, ramp: float, window: float, known: Floats) -> Floats:
    """Return the largest ṡ² at the edges that keeps the limits within the window; `b` is ṡ² without window.

    The limits of all cells within the window apply, and a faster motion passes more cells. Each round uses the times of
    the motion before it: the first motion becomes slower than necessary, the second too fast, and the third one lies in
    between and keeps the limits of its own times.
    """
    around = window + ramp
    for _ in range(ROUNDS):
        times = arrivals(way.edges, b)
        joints, tool = _lasting(way.joints, times, around), _lasting(way.tool, times, TOOL_SHARE * around)
        b = _passed(way.edges, joints, tool, known)
    return b


def _lasting(cells: Cells, times: Floats, window: float) -> Cells:
    """Combine each cell's limits with those of all cells passed in a time window; `times` at the edges."""
    return Cells(
        window_max(times, window, cells.fastest[:, None], True)[:, 0],
        window_max(times, window, cells.p, False),
        window_max(times, window, cells.q, False),
    )


def _goes_on(way: RetimingLimits, b: Floats, known: int) -> bool:
    """Return whether a motion fixed up to edge `known` keeps the limits in the cell behind this edge."""
    cell = slice(known, known + 1)
    acceleration = 0.5 * (b[known + 1] - b[known]) / (way.edges[known + 1] - way.edges[known])
    return all(
        bool((cells.p[cell] * abs(acceleration) + cells.q[cell] * b[known] <= 1.0 + ROUNDING).all())
        for cells in (way.joints, way.tool)
    )


def _passed(edges: Floats, joints: Cells, tool: Cells, known: Floats) -> Floats:
    """Return the largest ṡ² at the edges within limits of joints and tool; see `forward_backward_pass`."""
    p, q = np.hstack((joints.p, tool.p)), np.hstack((joints.q, tool.q))
    highest = np.minimum(joints.fastest, tool.fastest) ** 2
    return forward_backward_pass(
        edges, np.minimum(highest, 1.0 / np.maximum(q.max(axis=1), MIN_DIVISOR)), p, q, known
    )

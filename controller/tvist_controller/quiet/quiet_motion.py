"""Straight lines in joint space that leave no vibration, in the least time that a model of the arm permits."""

import math

import numpy as np

from tvist_controller.quiet.elastic_arm import ElasticArm, Remains
from tvist_controller.quiet.interior_point import Programme, inside, optimize
from tvist_controller.quiet.quiet_law import QuietLaw
from tvist_controller.trajectory import DoubleS, JointLine, MotionLimits, PlannedMotion, quickest_motion
from tvist_controller.trajectory.limits import Floats

QUIET = 0.02
"""Share of the vibration after the quickest motion that may remain, by the model [-]."""
WINDOW = 0.8
"""Time before the end from which accelerations count; what is older has died away [s]."""
STEPS = 5000
"""Largest number of steps for which each is a tick; longer motions have longer steps."""
LONGER = 0.3
"""Largest time by which a motion is made longer [s]."""
SPREAD = ((0.0, 0.8), (0.1, 0.42), (-0.1, 0.42))
"""Errors of all frequencies that are expected, and their weights, whose squares sum to 1 [-].

Against 3 %, 10 % make a move of the UR5e 10 ms longer, and reduce its vibration by 91 % instead of 77 % (median) if its
springs are 30 % softer than known.
"""
ROUNDS = 1
"""Number of times that the model is linearised about the motion that was found."""
REACHED = 1e-4
"""Smallest singular value that counts, relative to the largest [-]."""
SHARP = 1.0
"""Number of the permitted remains' sizes that one unit of the programme stands for, inverted [-]."""
SLOWEST = 0.1
"""Rates below this are planned for as this: such motions hardly shake the arm [-]."""


def quiet_motion(
    path: JointLine,
    limits: MotionLimits,
    arm: ElasticArm,
    period: float,
    speed: float = 1.0,
    agility: MotionLimits | None = None,
) -> PlannedMotion:
    """Return the quickest motion along a straight line from rest to rest that leaves hardly any vibration.

    It has at most `QUIET` of the quickest motion's vibration, by the model; if no motion that lasts up to `LONGER` more
    has, it is the one that leaves least.

    Args:
        path: Path of the motion.
        limits: Limits for every joint.
        arm: Model of the arm.
        period: Tick [s].
        speed: Initial rate of its time relative to the clock's [-]; it is quiet at this rate only.
        agility: See `PlannedMotion`.

    Raises:
        ValueError: There is no such motion within these limits, or it would last for hours.
    """
    quickest = quickest_motion(path, limits, period, speed, agility)
    if not np.any(path.direction):
        return quickest
    rate = speed if speed >= SLOWEST else 1.0
    search = _Search(path, path.planned(limits), arm, period, rate)
    return PlannedMotion(path, search.law(), period, speed, agility, quiet=True)


class _Search:
    """Search for the shortest quiet law of a line; its time is the clock's, so that limits are those at the rate."""

    def __init__(
        self, path: JointLine, limits: MotionLimits, arm: ElasticArm, period: float, rate: float
    ) -> None:
        self._path, self._limits, self._arm, self._rate = path, limits, arm, rate
        self._slope = path.end - path.start
        self._way = float(np.abs(self._slope).max())
        self._fastest, most, jerk = (
            limits.velocity * rate, limits.acceleration * rate**2, limits.jerk * rate**3
        )  # fmt: skip
        quickest = DoubleS(np.zeros(1), np.array([self._way]), MotionLimits(self._fastest, most, jerk))
        self._step = h = period * math.ceil(quickest.duration / (STEPS * period))
        self._first, self._second = most * h / self._fastest, jerk * h**2 / self._fastest
        self._shortest = math.ceil(quickest.duration / h - 1e-9)
        moments = h * np.arange(self._shortest + 1)
        states = np.array([quickest.at(float(time)) for time in moments])[:, :, 0] / self._way
        self._remains = self._linearised(states[:, 0], states[:, 1])
        self._allowed = QUIET * self._left(states[:, 2])

    def law(self) -> QuietLaw:
        """Return the law, in the time of the motion at full speed."""
        count, velocities = self._shortest_quiet()
        for _ in range(ROUNDS):
            share, speed, _ = self._law(velocities).shares()
            self._remains = self._linearised(share, speed)
            found, again = self._quietest(count)
            if found > self._allowed:  # the model has changed a little
                found, again = min(
                    (self._quietest(count + more) for more in (0, 1, 2)), key=lambda one: one[0]
                )
                count = len(again) + 2
            velocities = again
        return QuietLaw(
            self._path.start, self._path.end, velocities / self._rate, self._step * self._rate, self._limits
        )

    def _law(self, velocities: Floats) -> QuietLaw:
        return QuietLaw(self._path.start, self._path.end, velocities, self._step, self._limits)

    def _linearised(self, share: Floats, speed: Floats) -> Remains:
        """Linearise the model about the last part of a motion, given at all steps."""
        last = min(round(WINDOW / self._step), len(share) - 1) + 1
        q = self._path.start + np.outer(share[-last:], self._slope)
        found = [
            self._arm.remains(q, self._slope, speed[-last:], self._step * (1.0 + error))
            for error, _ in SPREAD
        ]
        return Remains(
            np.concatenate([one.rows * weight for one, (_, weight) in zip(found, SPREAD, strict=True)]),
            np.concatenate([one.offset * weight for one, (_, weight) in zip(found, SPREAD, strict=True)]),
        )

    def _left(self, accelerations: Floats) -> float:
        """What a motion leaves, given its accelerations at all steps."""
        rows, offset = self._remains.rows, self._remains.offset
        last = min(rows.shape[1], len(accelerations))
        return float(np.linalg.norm(rows[:, -last:] @ accelerations[-last:] + offset))

    def _shortest_quiet(self) -> tuple[int, Floats]:
        """Return the least number of steps, and the velocities [rad/s]."""
        tried = dict[int, tuple[float, Floats]]()
        low, more, most = self._shortest, 8, round(LONGER / self._step)
        while True:
            tried[self._shortest + more] = self._quietest(self._shortest + more)
            if tried[self._shortest + more][0] <= self._allowed:
                break
            low = self._shortest + more
            if more >= most:
                best = min(tried, key=lambda count: tried[count][0])
                return best, tried[best][1]
            more = min(2 * more, most)
        high = self._shortest + more
        while high - low > 1:
            middle = (low + high) // 2
            tried[middle] = self._quietest(middle)
            low, high = (low, middle) if tried[middle][0] <= self._allowed else (middle, high)
        return high, tried[high][1]

    def _quietest(self, count: int) -> tuple[float, Floats]:
        """Return what the quietest motion of a number of steps leaves, and its velocities [rad/s]."""
        unknowns = count - 2
        weights = np.zeros((len(self._remains.offset), count + 1))
        last = min(self._remains.rows.shape[1], count + 1)
        weights[:, -last:] = self._remains.rows[:, -last:]
        unit = self._fastest / (
            self._step * self._way
        )  # of accelerations, for velocities relative to the fastest
        rows = (weights[:, 1:-2] - weights[:, 2:-1]) * unit
        left, sizes, right = np.linalg.svd(rows, full_matrices=False)
        kept = sizes > REACHED * sizes[0]
        scale = SHARP / self._allowed
        whole = np.full((1, unknowns), self._step * self._fastest / self._way)
        programme = Programme(
            gain=np.zeros(unknowns),
            lowest=0.0,
            first=self._first,
            second=self._second,
            rows=np.concatenate((scale * sizes[kept, None] * right[kept], whole)),
            wanted=np.append(-scale * left[:, kept].T @ self._remains.offset, 1.0),
            price=np.append(np.ones(int(kept.sum())), 0.0),
        )
        c = inside(unknowns, self._first, self._second)
        if not optimize(programme, c):
            return math.inf, c * self._fastest
        return float(np.linalg.norm(rows @ c + self._remains.offset)), c * self._fastest

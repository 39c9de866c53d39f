"""A planned motion in progress: its parts, its rate and its pause."""

import numpy as np

from tvist_controller.cycle import STILL, ControlCycle
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.safety import acceleration_on_way
from tvist_controller.trajectory import PlannedMotion

PAUSE_SHARE = 0.95
"""Share of the acceleration permitted by the torque that a pause uses, since the filter may add a little [-]."""
LEAST_PAUSE = 0.2
"""Smallest share of a motion's acceleration that the torque must permit for a pause; else the motion runs on [-]."""


class RunningMove:
    """One motion.

    Args:
        number: Number of the motion.
        planned: Its plan, whose first part begins now.
        cycle: The control line.
    """

    def __init__(self, number: int, planned: PlannedMove, cycle: ControlCycle) -> None:
        self.number, self.velocity = number, planned.velocity
        self._window, self._cycle = planned.window, cycle
        self._held = False
        self._trajectory, *coming = planned.parts
        self.coming: tuple[PlannedMotion, ...] = tuple(coming)
        """Parts that have not begun."""
        self._begin()

    def go_on(self, rate: float) -> None:
        """Begin the next part at a rate [-]."""
        self._trajectory, *coming = self.coming
        self.coming, self._held = tuple(coming), False
        self._trajectory.speed = rate
        self._begin()

    def _begin(self) -> None:
        self._cycle.start(self._trajectory)
        self._cycle.tvist.aim(self._trajectory.path.end)

    @property
    def highest_rate(self) -> float:
        """Highest rate at which a shaper that was chosen after the motion began keeps the limits in bends [-]."""
        delay = self._cycle.tvist.delay
        return 1.0 if delay <= self._window else self._window / delay

    @property
    def rate(self) -> float:
        """Rate of its time [-]."""
        return self._trajectory.rate

    def go(self, rate: float) -> None:
        """Change the rate [-], unless the motion is paused."""
        if not self._held:
            self._trajectory.speed = rate

    def hold(self) -> None:
        """Slow down to a standstill within the torque limits, if that takes less time; see `PlannedMotion.hold`."""
        if self._held:
            return
        trajectory, cycle = self._trajectory, self._cycle
        most = trajectory.limits.acceleration
        newest = cycle.along.newest
        speed = max(trajectory.velocity, float(np.abs(newest.qd).max()))
        left = trajectory.path.end - newest.q
        farthest = float(np.abs(left).max())
        way = left * min(speed * speed / (most * max(farthest, STILL)), 1.0)
        limits = np.array(cycle.description.limits.torque)
        room = PAUSE_SHARE * acceleration_on_way(
            cycle.inverse_dynamics, trajectory.path, newest.q, way, speed, limits
        )
        if not trajectory.steady:  # the slider is changing its speed already, and may use all
            room = most
        self._held = room > LEAST_PAUSE * most and trajectory.hold(min(room, most))

    def release(self, rate: float) -> None:
        """Resume after a pause, at a rate [-]."""
        if self._held:
            self._trajectory.release(rate)
        self._held = False

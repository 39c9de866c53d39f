"""A point-to-point motion that is under way: its rate and its pause."""

import numpy as np

from tvist_controller.cycle import STILL, ControlCycle
from tvist_controller.safety import acceleration_on_way
from tvist_controller.trajectory import PlannedMotion

PAUSE_SHARE = 0.95
"""Share of the acceleration that torque leaves on the way that a pause uses: the filter may add a little [-]."""
LEAST_PAUSE = 0.2
"""Share of a motion's acceleration that torque must leave to a pause; otherwise the motion runs to its end [-]."""


class RunningMove:
    """One motion.

    Args:
        number: Its id.
        trajectory: Its reference, just started on the line.
        velocity: Limit that was asked for [rad/s].
        cycle: The control line.
    """

    def __init__(self, number: int, trajectory: PlannedMotion, velocity: float, cycle: ControlCycle) -> None:
        self.number, self.velocity = number, velocity
        self._trajectory, self._cycle = trajectory, cycle
        self._held = False

    @property
    def rate(self) -> float:
        """At which its time goes [-]."""
        return self._trajectory.rate

    def go(self, rate: float) -> None:
        """Change the rate [-]; a motion that is held by a pause stays so."""
        if not self._held:
            self._trajectory.speed = rate

    def hold(self) -> None:
        """Slow down to a standstill within the torque, where that ends it sooner; see `PlannedMotion.hold`."""
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
        if not trajectory.steady:  # the slider has it brake or hurry already, with all that it may
            room = most
        self._held = room > LEAST_PAUSE * most and trajectory.hold(min(room, most))

    def release(self, rate: float) -> None:
        """Go on after a pause, at a rate [-]."""
        if self._held:
            self._trajectory.release(rate)
        self._held = False

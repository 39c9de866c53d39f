"""Point to point with a double-S velocity profile."""

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Limits, Trajectory


class DoubleS(Trajectory):
    """Time-optimal motion at rest to rest, all joints in phase: a straight line in joint space.

    Velocity, acceleration and jerk limits hold for every joint; the joint with the longest way sets the pace
    (Biagiotti and Melchiorri 2008, ch. 3.4). With the paper's limits of 1.5 rad/s, 2.0 rad/s² and 100 rad/s³
    the acceleration ramps last 20 ms.

    Args:
        start: Joint positions at rest, shape (n,) [rad].
        target: Joint positions at rest, shape (n,) [rad].
        limits: For every joint.
        period: Tick [s].

    Raises:
        ValueError: There is no such motion within these limits, or it would last for hours.
    """

    def __init__(self, start: Floats, target: Floats, limits: Limits, period: float) -> None:
        n = len(start)
        request = ruckig.InputParameter(n)
        request.current_position, request.target_position = start.tolist(), target.tolist()
        request.max_velocity = [limits.velocity] * n
        request.max_acceleration = [limits.acceleration] * n
        request.max_jerk = [limits.jerk] * n
        request.synchronization = ruckig.Synchronization.Phase
        self._trajectory = ruckig.Trajectory(n)
        try:
            ruckig.Ruckig(n).calculate(request, self._trajectory)
        except (ruckig.RuckigError, ValueError) as error:  # beyond 7600 s its result is one it cannot name
            raise ValueError(
                f"no motion goes from {start.tolist()} to {target.tolist()} in less than two hours within "
                f"velocity {limits.velocity:g}, acceleration {limits.acceleration:g}, jerk {limits.jerk:g}"
            ) from error
        self._target = np.array(target, dtype=float)
        self._period = period
        self._ticks = 0

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return float(self._trajectory.duration)

    def next(self) -> Floats:
        """Position one tick further; the target exactly from the first tick at or after the end."""
        self._ticks += 1
        if self.finished:
            return self._target
        position, _, _ = self._trajectory.at_time(self._ticks * self._period)
        return np.array(position)

    @property
    def finished(self) -> bool:
        """Whether the target was reached."""
        return self._ticks * self._period >= self.duration

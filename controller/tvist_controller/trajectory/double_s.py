"""The double-S time law, which moves a path's parameter from rest to rest as quickly as its limits permit."""

import numpy as np
import ruckig

from tvist_controller.trajectory.limits import Floats, MotionLimits


class DoubleS:
    """Time-optimal motion from rest to rest within limits, shape (m,) [rad], all entries in phase.

    The entry with the longest way determines the duration (Biagiotti and Melchiorri 2008, ch. 3.4). With the paper's
    limits of 1.5 rad/s, 2.0 rad/s² and 100 rad/s³, the acceleration ramps last 20 ms.

    Raises:
        ValueError: There is no such motion within these limits, or it would last for hours.
    """

    def __init__(self, start: Floats, end: Floats, limits: MotionLimits) -> None:
        m = len(start)
        request = ruckig.InputParameter(m)
        request.current_position, request.target_position = start.tolist(), end.tolist()
        request.max_velocity = [limits.velocity] * m
        request.max_acceleration = [limits.acceleration] * m
        request.max_jerk = [limits.jerk] * m
        request.synchronization = ruckig.Synchronization.Phase
        self._trajectory = ruckig.Trajectory(m)
        try:
            ruckig.Ruckig(m).calculate(request, self._trajectory)
        except (ruckig.RuckigError, ValueError) as error:  # ruckig's way to fail above 7600 s
            raise ValueError(
                f"no motion goes from {start.tolist()} to {end.tolist()} in less than two hours within "
                f"velocity {limits.velocity:g}, acceleration {limits.acceleration:g}, jerk {limits.jerk:g}"
            ) from error
        self.limits = limits
        """Limits that it keeps."""
        self.begins = 0.0
        """Time from which on it is known [s]."""
        self.duration = float(self._trajectory.duration)
        """Duration from rest to rest [s]."""
        # The motion from rest to rest is symmetric in time: it brakes for as long as it accelerates.
        leading = self._trajectory.profiles[0][int(np.argmax(np.abs(end - start)))]
        self.brakes_at = self.duration - sum(leading.t[:3])
        """Time at which it begins to slow down [s]."""
        self.moments: Floats = np.cumsum(leading.t)
        """Times at which the jerk changes, so that velocity or acceleration may be largest [s]."""

    def at(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Parameter [rad], its velocity [rad/s] and its acceleration [rad/s^2] at a time [s], with m numbers each."""
        position, velocity, acceleration = self._trajectory.at_time(time)[:3]
        return position, velocity, acceleration

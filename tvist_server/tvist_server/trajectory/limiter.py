"""Keep a stream inside limits of velocity and acceleration, and leave it untouched where it already is."""

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Limits


class Limiter:
    """Follows a position signal exactly while that is within the limits; catches up time-optimally otherwise.

    The jerk limit shapes the catching up; what keeps the limits of velocity and acceleration passes as it is.

    Args:
        q: Position at rest to start from, shape (n,) [rad].
        limits: For every joint.
        period: Tick [s].
    """

    TOLERANCE = 1e-6
    """Share of a limit that rounding may exceed [-]."""

    def __init__(self, q: Floats, limits: Limits, period: float) -> None:
        n = len(q)
        self._limits, self._period = limits, period
        self.q, self.qd, self.qdd = np.array(q, dtype=float), np.zeros(n), np.zeros(n)
        self._step = np.zeros(n)  # the last one, in position
        self._generator = ruckig.Ruckig(n, period)
        self._request, self._result = ruckig.InputParameter(n), ruckig.OutputParameter(n)
        self._request.max_velocity = [limits.velocity] * n
        self._request.max_acceleration = [limits.acceleration] * n
        self._request.max_jerk = [limits.jerk] * n
        self._request.synchronization = ruckig.Synchronization.No
        self.limited = False

    def follow(self, q: Floats, qd: Floats) -> Floats:
        """One tick towards a position that itself moves.

        Args:
            q: Where the stream is, shape (n,) [rad].
            qd: How fast it moves there, shape (n,) [rad/s].

        Returns:
            Where the reference is, shape (n,) [rad]; `limited` tells whether that is not q.
        """
        h = self._period
        step = q - self.q
        velocity, acceleration = step / h, (step - self._step) / (h * h)
        room = 1.0 + self.TOLERANCE
        self.limited = bool(
            np.abs(velocity).max() > room * self._limits.velocity
            or np.abs(acceleration).max() > room * self._limits.acceleration
        )
        if not self.limited:
            # A motion continued from here has the second difference q̈ at its first tick.
            self.q, self.qd, self.qdd = q, velocity + 0.5 * h * acceleration, acceleration
            self._step = step
            return q
        before = self.q
        try:
            self._catch_up(q, qd)
        except (ruckig.RuckigError, ValueError):  # it would take more than 7600 s
            self._brake()
        self._step = self.q - before
        return self.q

    def _catch_up(self, q: Floats, qd: Floats) -> None:
        request, result = self._request, self._result
        limits = self._limits
        request.current_position = self.q.tolist()
        request.current_velocity = self.qd.tolist()
        request.current_acceleration = np.clip(self.qdd, -limits.acceleration, limits.acceleration).tolist()
        request.target_position = q.tolist()
        request.target_velocity = np.clip(qd, -limits.velocity, limits.velocity).tolist()
        self._generator.update(request, result)
        self.q, self.qd = np.array(result.new_position), np.array(result.new_velocity)
        self.qdd = np.array(result.new_acceleration)

    def _brake(self) -> None:
        h, limit = self._period, self._limits.acceleration
        self.qdd = np.clip(-self.qd / h, -limit, limit)
        self.q, self.qd = self.q + h * (self.qd + 0.5 * h * self.qdd), self.qd + h * self.qdd

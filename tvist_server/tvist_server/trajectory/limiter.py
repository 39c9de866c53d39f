"""Keep a stream inside limits of velocity and acceleration, and leave it untouched where it already is."""

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Limits


class Limiter:
    """Follows a position signal exactly while that takes no more than the limits; catches up time-optimally otherwise.

    The jerk limit shapes the catching up; a stream inside its limits of velocity and acceleration passes to the bit.

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
        velocity = (q - self.q) / self._period
        acceleration = (velocity - self.qd) / self._period
        room = 1.0 + self.TOLERANCE
        self.limited = bool(
            np.abs(velocity).max() > room * self._limits.velocity
            or np.abs(acceleration).max() > room * self._limits.acceleration
        )
        if not self.limited:
            self.q, self.qd, self.qdd = q, velocity, acceleration
            return q
        return self._catch_up(q, qd)

    def _catch_up(self, q: Floats, qd: Floats) -> Floats:
        request, result = self._request, self._result
        limits = self._limits
        request.current_position = self.q.tolist()
        request.current_velocity = self.qd.tolist()
        request.current_acceleration = np.clip(self.qdd, -limits.acceleration, limits.acceleration).tolist()
        request.target_position = q.tolist()
        request.target_velocity = np.clip(qd, -limits.velocity, limits.velocity).tolist()
        outcome = self._generator.update(request, result)
        if outcome not in {ruckig.Result.Working, ruckig.Result.Finished}:
            raise ArithmeticError(f"limiter: {outcome} from {self.q.tolist()} to {q.tolist()}")
        self.q, self.qd = np.array(result.new_position), np.array(result.new_velocity)
        self.qdd = np.array(result.new_acceleration)
        return self.q

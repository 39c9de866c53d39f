"""Keep a stream inside limits of velocity and acceleration, and leave it untouched where it already is."""

import numpy as np
import ruckig

from tvist_server.trajectory.base import Floats, Limits


class Limiter:
    """Follows a position signal exactly while that is within the limits; catches up time-optimally otherwise.

    Each joint by itself. A joint that is behind moves relative to the signal: to where that is, at the velocity
    and acceleration it has there, so that a signal in motion is caught up with, too. The jerk limit shapes the
    catching up; what keeps the limits of velocity and acceleration passes as it is.

    Args:
        q: Position at rest to start from, shape (n,) [rad].
        limits: For every joint.
        period: Tick [s].
    """

    TOLERANCE = 1e-6
    """Share of a limit that rounding may exceed [-]."""
    ADVANTAGE = 0.01
    """Share of the velocity limit by which one that is behind may always be faster than what it follows [-]."""
    AUTHORITY = 0.1
    """Share of the acceleration limit that is always left for catching up [-]."""

    def __init__(self, q: Floats, limits: Limits, period: float) -> None:
        n = len(q)
        self._limits, self._period = limits, period
        self.q, self.qd, self.qdd = np.array(q, dtype=float), np.zeros(n), np.zeros(n)
        self._step, self._signal_qd = np.zeros(
            (2, n)
        )  # displacement of the last tick; velocity of the signal
        self._behind = np.zeros(n, dtype=bool)
        self._generator = ruckig.Ruckig(n, period)
        self._request, self._result = ruckig.InputParameter(n), ruckig.OutputParameter(n)
        self._request.target_position = self._request.target_velocity = [0.0] * n
        self._request.max_jerk = [limits.jerk] * n
        self._request.synchronization = ruckig.Synchronization.No

    @property
    def limited(self) -> bool:
        """Whether the reference is not where the signal is."""
        return bool(self._behind.any())

    def follow(self, q: Floats, qd: Floats) -> Floats:
        """One tick towards a position that itself moves.

        Args:
            q: Where the signal is, shape (n,) [rad].
            qd: How fast it moves there, shape (n,) [rad/s].

        Returns:
            Where the reference is, shape (n,) [rad].
        """
        h, limits, room = self._period, self._limits, 1.0 + self.TOLERANCE
        most = (1.0 - self.AUTHORITY) * limits.acceleration
        signal_qdd = np.clip((qd - self._signal_qd) / h, -most, most)
        self._signal_qd = qd
        step = q - self.q
        velocity, acceleration = step / h, (step - self._step) / (h * h)
        fits = (np.abs(velocity) <= room * limits.velocity) & (
            np.abs(acceleration) <= room * limits.acceleration
        )
        # One that is behind must not jump at the signal with a velocity that it then cannot take back.
        following = (qd - velocity) / h + 0.5 * signal_qdd
        fits &= ~self._behind | (np.abs(following) <= limits.acceleration)
        self._behind = ~fits
        # A motion continued from this state has the second difference q̈ at its first tick.
        state: Floats = np.stack((q, velocity + 0.5 * h * acceleration, acceleration))
        if self._behind.any():
            try:
                caught_up = self._catch_up(q, qd, signal_qdd)
            except (ruckig.RuckigError, ValueError):  # it would take more than 7600 s
                caught_up = self._brake()
            state = np.where(fits, state, caught_up)
        self._step = state[0] - self.q
        self.q, self.qd, self.qdd = state
        return self.q

    def _catch_up(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """State, shape (3, n), after a tick of the way onto a signal that goes on with this acceleration."""
        request, result, limits, h = self._request, self._result, self._limits, self._period
        fastest = (1.0 - self.ADVANTAGE) * limits.velocity
        qd = np.clip(qd, -fastest, fastest)
        request.current_position = (self.q - (q - h * (qd - 0.5 * h * qdd))).tolist()
        request.current_velocity = (self.qd - (qd - h * qdd)).tolist()
        present = np.clip(self.qdd, -limits.acceleration, limits.acceleration)
        request.current_acceleration = (present - qdd).tolist()
        request.max_velocity = (limits.velocity - qd).tolist()
        request.min_velocity = (-limits.velocity - qd).tolist()
        request.max_acceleration = (limits.acceleration - qdd).tolist()
        request.min_acceleration = (-limits.acceleration - qdd).tolist()
        self._generator.update(request, result)
        signal: Floats = np.stack((q, qd, qdd))
        signal += (result.new_position, result.new_velocity, result.new_acceleration)
        return signal

    def _brake(self) -> Floats:
        h, limit = self._period, self._limits.acceleration
        qdd = np.clip(-self.qd / h, -limit, limit)
        return np.stack((self.q + h * (self.qd + 0.5 * h * qdd), self.qd + h * qdd, qdd))

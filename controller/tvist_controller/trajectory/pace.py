"""Time rate of a trajectory: speed slider, pause and resume."""

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np
import ruckig

from tvist_controller.trajectory.limits import Floats, MotionLimits

QUICKEST = 20.0  # largest change of the rate; from standstill to full speed takes at least 1/20 s [1/s]


class TimeScaling:
    """Time rate r of a trajectory, 0 to 1, whose changes keep the motion's limits.

    Along a path q(s) with ṡ = r the acceleration is q̈ = q'' r² + q' ṙ. ṙ may have any value that keeps |q̈| within
    every joint's limit, so near the limits the rate does not change until the curve leaves room. The rate approaches
    its target time-optimally within that room, with limited jerk (ruckig), in ticks of `period` seconds.
    """

    def __init__(self, limits: MotionLimits, period: float, rate: float) -> None:
        self.limits, self._period = limits, period
        self.acceleration = limits.acceleration
        """Acceleration limit of every joint, the motion's or less [rad/s^2]."""
        self.rate, self._slope = rate, 0.0
        self._open()

    def _open(self) -> None:
        self._generator = ruckig.Ruckig(1, self._period)
        self._request, self._result = ruckig.InputParameter(1), ruckig.OutputParameter(1)
        self._request.control_interface = ruckig.ControlInterface.Velocity

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other._open()  # noqa: SLF001  one of its own kind
        return other

    def steady(self, target: float) -> bool:
        """Return whether the rate stays at its target."""
        return self.rate == target and self._slope == 0.0

    def advance(self, target: float, curve: Sequence[Floats]) -> float:
        """Advance by one tick towards a target rate [-]; return the time that passes on the path [s].

        `curve` has q' [rad/s] and q'' [rad/s^2], each (2, n), at the present point and just ahead; the rate
        must suit both, since a tick has finite length.
        """
        rooms = [self._room(qd, qdd) for qd, qdd in curve]
        # ruckig requires limits on both sides of zero, so leave a little room in both directions.
        lowest = min(max(room[0] for room in rooms), -1e-3)
        highest = max(min(room[1] for room in rooms), 1e-3)
        request = self._request
        request.current_position, request.current_velocity = [0.0], [self.rate]
        request.current_acceleration = [min(max(self._slope, lowest), highest)]
        request.target_velocity, request.target_acceleration = [target], [0.0]
        request.max_acceleration, request.min_acceleration = [highest], [lowest]
        fastest = max(float(np.abs(qd).max()) for qd, _ in curve)
        request.max_jerk = [self.limits.jerk / max(fastest, 0.05)]
        self._generator.update(request, self._result)
        self.rate = min(max(self._result.new_velocity[0], 0.0), 1.0)
        self._slope = self._result.new_acceleration[0]
        if abs(self.rate - target) < 1e-9 and abs(self._slope) < 1e-6:
            self.rate, self._slope = target, 0.0
        return max(float(self._result.new_position[0]), 0.0)

    def _room(self, qd: Floats, qdd: Floats) -> tuple[float, float]:
        """Return the range of ṙ that keeps every joint within its acceleration [1/s]."""
        lowest, highest = -QUICKEST, QUICKEST
        own = qdd * self.rate**2
        for velocity, acceleration in zip(qd.tolist(), own.tolist(), strict=True):
            if abs(velocity) < 1e-9:
                continue
            ends = sorted((sign * self.acceleration - acceleration) / velocity for sign in (-1.0, 1.0))
            lowest, highest = max(lowest, ends[0]), min(highest, ends[1])
        return lowest, highest

"""Bases of the references that a client guides: each of its commands replaces the one before."""

from abc import abstractmethod
from collections.abc import Callable

from tvist_controller.trajectory.base import Trajectory
from tvist_controller.trajectory.limiter import Limiter, TorqueRoom
from tvist_controller.trajectory.limits import Floats, MotionLimits


class StuckError(Exception):
    """No reference follows that keeps to what was commanded; the message gives the reason."""


class Guided(Trajectory):
    """A reference that follows the latest command until another one comes."""

    limits: MotionLimits
    foreseeable = False
    rate: float
    """Rate of its time relative to the clock's [-]."""

    @property
    @abstractmethod
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""

    @abstractmethod
    def adopt(self, limits: MotionLimits) -> None:
        """Keep other limits of the joints from now on; `pace` must follow."""

    def adapt(self, spared: Callable[[MotionLimits | None], MotionLimits]) -> None:
        """See `Trajectory.adapt`."""
        self.adopt(spared(None))

    @abstractmethod
    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the programmed speed fraction [-] and the velocity limit of reduced speed, if it is reduced [rad/s]."""


class Following(Guided):
    """Passes a signal through a `Limiter`: within the arm's limits, the joints' range and the available torque.

    The client determines the timing of the signal, so the speed slider has no effect on it; reduced speed limits the
    velocity.
    """

    def __init__(
        self,
        state: tuple[Floats, Floats, Floats],  # to continue from, q, q̇ and q̈, each of shape (n,)
        limits: MotionLimits,
        reach: Floats,  # largest |q| of each joint, shape (n,) [rad]
        torque: TorqueRoom,
        period: float,  # tick [s]
    ) -> None:
        self.limits = self._arm = limits
        self._reach, self._torque, self._period = reach, torque, period
        self.rate = 1.0
        self._follow(state)

    def _follow(self, state: tuple[Floats, Floats, Floats]) -> None:
        self._limiter = Limiter(
            state[0], self.limits, self._period, reach=self._reach, torque=self._torque, state=state
        )

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of the reference, each of shape (n,)."""
        return self._limiter.state

    def adopt(self, limits: MotionLimits) -> None:
        """See `Guided.adopt`."""
        self.limits = self._arm = limits
        self._follow(self.state)

    def pace(self, speed: float, slowest: float | None) -> None:
        """Set the speed that is reported, and the velocity limit."""
        self.rate = speed
        velocity = self._arm.velocity if slowest is None else min(slowest, self._arm.velocity)
        if velocity != self.limits.velocity:
            self.limits = MotionLimits(velocity, self._arm.acceleration, self._arm.jerk)
            self._follow(self.state)

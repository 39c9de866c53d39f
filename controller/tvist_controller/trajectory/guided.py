"""Base of the references that a client guides: each of its commands replaces the one before."""

from abc import abstractmethod
from collections.abc import Callable

from tvist_controller.trajectory.base import Trajectory
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
        """Set the speed.

        Args:
            speed: Programmed speed fraction [-].
            slowest: Velocity limit of reduced speed [rad/s]; None if the speed is not reduced.
        """

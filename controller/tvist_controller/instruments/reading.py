"""What every value of a tick is read from."""

from typing import Any

from tvist_controller.instruments.meters import Meters
from tvist_controller.instruments.ratings import JointRating
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import RUNNING, ToolWrench
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

POWERED = frozenset(range(RobotMode.POWER_ON, RobotMode.RUNNING + 1))
"""Robot modes in which the arm has power."""


class Reading:
    """One tick of one robot.

    The docstring of each value below begins with where it is from: State and Io carry it, Computed says from
    what, Constant says what stands in for something that is not simulated.

    Args:
        state: The tick.
        io: Terminals and registers in force.
        rigid: The arm's mechanics, shared by all ticks.
        wrench: What pushes its tool, shared likewise.
        ratings: Ratings of the joints.
        current: Currents of the motors [A].
        meters: Temperatures and energies at this tick.
        kept: Values that interfaces keep from tick to tick.
    """

    def __init__(
        self,
        state: State,
        io: Io,
        rigid: RigidBody,
        wrench: ToolWrench,
        ratings: list[JointRating],
        current: list[float],
        meters: Meters,
        kept: dict[str, Any],
    ) -> None:
        self.state = state
        """The tick as it was told."""
        self.io = io
        """Terminals and registers as they were told."""
        self.shared: dict[str, Any] = {}
        """What interfaces made of this tick, so that all their clients share it."""
        self.kept = kept
        """What interfaces keep from tick to tick."""
        self._current = current
        self._temperatures = meters.temperatures
        self._power, self._consumed, self._dissipated = meters.power, meters.consumed, meters.dissipated
        self._rigid, self._wrench = rigid, wrench
        self._ratings = ratings

    @property
    def powered(self) -> bool:
        """Whether the robot's mode is one with power."""
        return self.state.robot_mode in POWERED

    @property
    def driven(self) -> bool:
        """Whether the drives hold the arm, and no brake does."""
        return self.state.robot_mode == RUNNING

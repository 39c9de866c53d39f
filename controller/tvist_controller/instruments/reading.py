"""Base of all values of a tick."""

from tvist_controller.instruments.joint_lists import as_rows, joint_lists
from tvist_controller.instruments.meters import Meters
from tvist_controller.instruments.ratings import JointRating
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.variables import Vector6D, computed_once
from tvist_controller.instruments.wrench import RUNNING, ToolWrench
from tvist_plant.model import Floats
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

POWERED = frozenset(range(RobotMode.POWER_ON, RobotMode.RUNNING + 1))
"""Robot modes in which the arm has power."""


class Reading:
    """One tick of one robot.

    The docstring of each value in the derived classes begins with its source. State and Io: the message contains it.
    Computed: what it is computed from. Constant: what stands for something that is not simulated.

    Args:
        state: State of the tick.
        io: Terminals and registers in force.
        rigid: The arm's mechanics, shared by all ticks.
        wrench: Computes the external force at the tool, shared by all ticks.
        ratings: Ratings of the joints.
        current: Currents of the motors [A].
        meters: Temperatures and energies at this tick.
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
    ) -> None:
        self.state = state
        """State of the tick, as published."""
        self.io = io
        """Terminals and registers, as published."""
        self.shared: dict[str, bytes] = {}
        """Packages that interfaces make of this tick and share among all clients."""
        self._current = current
        self._temperatures = meters.temperatures
        self._power, self._consumed, self._dissipated = meters.power, meters.consumed, meters.dissipated
        self._rigid, self._wrench = rigid, wrench
        self._ratings = ratings

    @property
    def target_q(self) -> Vector6D:
        """State: reference before shaping, which is what the program or the client asks for [rad]."""
        return self.state.target_q if self.state.unshaped_q is None else self.state.unshaped_q

    @property
    def target_qd(self) -> Vector6D:
        """State: velocity of the reference before shaping [rad/s]."""
        return self.state.target_qd if self.state.unshaped_qd is None else self.state.unshaped_qd

    @property
    def target_qdd(self) -> Vector6D:
        """State: acceleration of the reference before shaping [rad/s²]."""
        return self.state.target_qdd if self.state.unshaped_qdd is None else self.state.unshaped_qdd

    @property
    def powered(self) -> bool:
        """Whether the arm has power in the present robot mode."""
        return self.state.robot_mode in POWERED

    @property
    def driven(self) -> bool:
        """Whether the drives hold the arm, with the brakes released."""
        return self.state.robot_mode == RUNNING

    @computed_once
    def joint_lists(self) -> bytearray:
        """Lists of the state that values are computed from, see `joint_lists`."""
        return joint_lists(self.state)

    @computed_once
    def _motion(self) -> Floats:
        """The same as an array, shape (10, n)."""
        return as_rows(self.joint_lists)

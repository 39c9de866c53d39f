"""One tick of a robot as UR's interfaces report it, under RTDE's names."""

from tvist_controller.instruments.joints import JointValues
from tvist_controller.instruments.meters import Meters
from tvist_controller.instruments.ratings import joint_ratings
from tvist_controller.instruments.reading import POWERED, Reading
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.status import StatusValues
from tvist_controller.instruments.terminals import TerminalValues
from tvist_controller.instruments.tool import ToolValues
from tvist_controller.instruments.variables import variables
from tvist_controller.instruments.wrench import RUNNING, ToolWrench
from tvist_plant.description import RobotDescription
from tvist_protocol.io import Io
from tvist_protocol.stream import State


class Snapshot(StatusValues, JointValues, ToolValues, TerminalValues):
    """Every output variable of RTDE is an attribute; expensive ones are computed on first access."""


VARIABLES = variables(Reading, *Snapshot.__bases__)
"""RTDE's word for the type of each output variable that is no register, by name."""


class Instruments:
    """Reads a robot's values tick by tick; if ticks are skipped, temperatures and energies are less accurate.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._rigid, self._wrench = RigidBody(description), ToolWrench(description)
        self._ratings = joint_ratings(description)
        self._constants = [rating.torque_constant for rating in self._ratings]
        self._idle = [0.0] * description.joints
        self._meters = Meters(self._ratings)

    def snapshot(self, state: State, io: Io) -> Snapshot:
        """Return the values of a tick.

        Args:
            state: State of the tick.
            io: Terminals and registers at that tick.
        """
        current = self.follow(state.tick, state.robot_mode, state.actual_moment, state.actual_qd)
        return Snapshot(state, io, self._rigid, self._wrench, self._ratings, current, self._meters)

    def follow(self, tick: int, mode: int, moment: list[float], velocity: list[float]) -> list[float]:
        """Let temperatures and energies go on to a tick whose other values nobody reads; return the currents [A].

        Args:
            tick: Number of the control period; once for each period is enough.
            mode: Robot mode.
            moment: Measured torques [N m].
            velocity: Measured velocities [rad/s].
        """
        current, mechanical = self._idle, 0.0
        if mode == RUNNING:
            current = [m / constant for m, constant in zip(moment, self._constants, strict=True)]
            mechanical = sum([m * v for m, v in zip(moment, velocity, strict=True)])
        self._meters.update(tick, current, mechanical, powered=mode in POWERED)
        return current

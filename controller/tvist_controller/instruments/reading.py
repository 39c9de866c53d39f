"""One tick of one robot: its messages, and quantities that several RTDE variables depend on."""

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tvist_controller.instruments.motors import JointRating, Meters
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import (
    ACTUAL_Q,
    ACTUAL_QD,
    ROWS,
    RUNNING,
    SHAPED,
    UNSHAPED,
    joint_lists,
)
from tvist_plant.model import Floats
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

POWERED = frozenset(range(RobotMode.POWER_ON, RobotMode.RUNNING + 1))  # robot modes with arm power


class Reading:
    """One tick of one robot; quantities are computed on first read."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a variable that `Snapshot` adds."""

    def __init__(
        self,
        state: State,
        io: Io,
        rigid: RigidBody,
        ratings: list[JointRating],
        current: list[float],
        meters: Meters,
    ) -> None:
        self.state = state  # state of the tick, as published
        self.io = io  # terminals and registers, as published
        self.shared: dict[str, bytes] = {}  # packages of this tick that interfaces share among all clients
        self.current = current  # currents of the motors [A]
        self.temperatures = meters.temperatures  # temperatures of the joints [°C]
        self.power, self.consumed, self.dissipated = meters.power, meters.consumed, meters.dissipated
        """Power from the supply [W], energy from it and energy of braking since the first tick [J]."""
        self.rigid, self.ratings = rigid, ratings

    @property
    def powered(self) -> bool:
        """Whether the arm has power."""
        return self.state.robot_mode in POWERED

    @property
    def driven(self) -> bool:
        """Whether the drives hold the arm, with released brakes."""
        return self.state.robot_mode == RUNNING

    @cached_property
    def joint_lists(self) -> bytearray:
        """The state's joint values as bytes, see `wrench.joint_lists`."""
        return joint_lists(self.state)

    @cached_property
    def motion(self) -> Floats:
        """The values of `joint_lists` as an array with one row per quantity, shape (10, n)."""
        return np.ndarray((ROWS, len(self.ratings)), buffer=self.joint_lists)

    @cached_property
    def target(self) -> Floats:
        """Tool motion of the unshaped reference, see `RigidBody.tool`, shape (18,)."""
        return self.rigid.tool(self.motion[UNSHAPED], self.io.tcp_offset)

    @cached_property
    def shaped(self) -> Floats:
        """Tool motion of the shaped reference, shape (18,)."""
        if self.state.unshaped_q is None:
            return self.target
        return self.rigid.tool(self.motion[SHAPED], self.io.tcp_offset)

    @cached_property
    def elbow(self) -> tuple[list[float], list[float]]:
        """Measured position [m] and velocity [m/s] of the elbow."""
        return self.rigid.elbow(self.motion[ACTUAL_Q], self.motion[ACTUAL_QD])

    @cached_property
    def rotation(self) -> Floats:
        """Measured rotation from flange to base frame, shape (3, 3)."""
        return self.rigid.arm.pose(self.motion[ACTUAL_Q])[0]

    @cached_property
    def estimate(self) -> Floats:
        """External force and torque at the TCP [N, N m], then joint torques [N m], shape (6 + n,)."""
        if not self.driven:
            return np.zeros(6 + len(self.ratings))
        return self.rigid.external(self.motion, self.io.tcp_offset)

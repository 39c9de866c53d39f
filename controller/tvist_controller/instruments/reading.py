"""One tick of one robot: its messages, and what several variables of RTDE are computed from."""

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tvist_controller.instruments.motors import JointRating, Meters
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import (
    ACTUAL_Q,
    ACTUAL_QD,
    RUNNING,
    SHAPED,
    UNSHAPED,
    as_rows,
    joint_lists,
)
from tvist_plant.model import Floats
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

POWERED = frozenset(range(RobotMode.POWER_ON, RobotMode.RUNNING + 1))
"""Robot modes in which the arm has power."""

if TYPE_CHECKING:
    computed_once = cached_property
else:

    class computed_once:  # noqa: N801  it stands for a property
        """A property that is computed when it is first read; `cached_property` of Python 3.11 takes a lock as well."""

        def __init__(self, func: Callable[[Any], Any]) -> None:
            self.func, self.__doc__ = func, func.__doc__

        def __set_name__(self, owner: type, name: str) -> None:
            self.name = name

        def __get__(self, of: Any, owner: type) -> Any:
            value = of.__dict__[self.name] = self.func(of)
            return value


class Reading:
    """One tick of one robot, with what its variables are computed from, each when it is first read."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a variable, which `Snapshot` adds."""

    def __init__(
        self,
        state: State,
        io: Io,
        rigid: RigidBody,
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
        self.current = current
        """Currents of the motors [A]."""
        self.temperatures = meters.temperatures
        """Temperatures of the joints [°C]."""
        self.power, self.consumed, self.dissipated = meters.power, meters.consumed, meters.dissipated
        """Power from the supply [W]; energy from it, and returned by braking, since the first tick [J]."""
        self.rigid, self.ratings = rigid, ratings

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
    def motion(self) -> Floats:
        """The same as an array, shape (10, n)."""
        return as_rows(self.joint_lists)

    @computed_once
    def target(self) -> Floats:
        """Motion of the tool by the reference before shaping, see `RigidBody.tool`, shape (18,)."""
        return self.rigid.tool(self.motion[UNSHAPED], self.io.tcp_offset)

    @property
    def target_tool(self) -> bytes:
        """The same as doubles in the machine's order."""
        return self.target.tobytes()

    @computed_once
    def shaped(self) -> Floats:
        """Motion of the tool by the reference after shaping, shape (18,)."""
        if self.state.unshaped_q is None:
            return self.target
        return self.rigid.tool(self.motion[SHAPED], self.io.tcp_offset)

    @computed_once
    def elbow(self) -> tuple[list[float], list[float]]:
        """Position [m] and velocity [m/s] of the elbow, as measured."""
        return self.rigid.elbow(self.motion[ACTUAL_Q], self.motion[ACTUAL_QD])

    @computed_once
    def rotation(self) -> Floats:
        """Rotation from the flange to the base frame, as measured, shape (3, 3)."""
        return self.rigid.flange_rotation(self.motion[ACTUAL_Q])

    @computed_once
    def estimate(self) -> Floats:
        """Force at the TCP [N, N m], then external torques on the joints [N m], shape (6 + n,)."""
        if not self.driven:
            return np.zeros(6 + len(self.ratings))
        return self.rigid.external(self.motion, self.io.tcp_offset)

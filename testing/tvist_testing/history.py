"""What a robot measured during a test, in little memory: a row of numbers for each tick."""

from array import array
from collections import deque
from typing import TYPE_CHECKING

from tvist_protocol.modes import RuntimeState

if TYPE_CHECKING:
    from tvist_protocol.info import Limits
    from tvist_protocol.stream import Event, State, Truth

LONGEST = 300_000
"""Largest number of rows that are kept; ten minutes of simulation."""
EVENTS = 10_000
"""Largest number of events that are kept."""


class Row:
    """Measured values at a tick."""

    __slots__ = ("acceleration", "moment", "moving", "pose", "q", "qd", "qdd", "tick", "time", "tool_speed")

    def __init__(self, state: "State", truth: "Truth | None") -> None:
        self.tick = state.tick
        self.time = state.timestamp
        """Simulation time [s]."""
        self.moving = state.runtime_state != RuntimeState.STOPPED
        """True while the shaped reference moves."""
        self.q = array("d", state.actual_q)
        """Measured joint angles [rad]."""
        self.qd = array("d", state.actual_qd)
        """Measured joint velocities [rad/s]."""
        self.qdd = array("d", state.target_qdd)
        """Accelerations of the shaped reference [rad/s²]."""
        self.moment = array("d", state.actual_moment)
        """Measured joint torques [N m]."""
        self.tool_speed = array("d", state.actual_TCP_speed)
        """Velocity of the tool centre point [m/s], and its angular velocity [rad/s]."""
        self.pose = array("d", truth.flange_pose if truth else state.actual_TCP_pose)
        """Pose of the flexible arm's flange, else of the measured tool: x y z [m], rotation vector [rad]."""
        self.acceleration = array("d", truth.tool_acceleration if truth else state.actual_tool_accelerometer)
        """Specific force at the flange, without noise if there is truth, in its own frame [m/s²]."""


class History:
    """The last ten minutes of a robot.

    Attributes:
        joint_limits: The robot's limits; None before it has been asked.
        period: Control period [s].
    """

    def __init__(self) -> None:
        self.joint_limits: Limits | None = None
        self.period = 0.002
        self.rows: deque[Row] = deque(maxlen=LONGEST)
        self.events: deque[Event] = deque(maxlen=EVENTS)
        self._truth: Truth | None = None

    def on_truth(self, truth: "Truth") -> None:
        """Take what a real robot cannot measure; it comes after the state of its tick."""
        self._truth = truth
        if self.rows and self.rows[-1].tick == truth.tick:
            self.rows[-1].pose = array("d", truth.flange_pose)
            self.rows[-1].acceleration = array("d", truth.tool_acceleration)

    def on_state(self, state: "State") -> None:
        """Take a state; that before the first tick, which measures nothing, is left out."""
        if state.tick > 0:
            truth = self._truth if self._truth is not None and self._truth.tick == state.tick else None
            self.rows.append(Row(state, truth))

    def on_event(self, event: "Event") -> None:
        """Take an event."""
        self.events.append(event)

    def since_rest(self) -> list[Row]:
        """Return the rows after the one in which the shaped reference came to rest last; all if it never moved."""
        rows: list[Row] = []
        for row in reversed(self.rows):
            if row.moving:
                break
            rows.append(row)
        return rows[::-1]

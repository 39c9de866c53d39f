"""A robot's measurements during a test, compact in memory: a row of numbers for each tick."""

from array import array
from collections import deque
from itertools import takewhile
from typing import TYPE_CHECKING

from tvist_protocol.modes import RuntimeState

if TYPE_CHECKING:
    from tvist_protocol.info import Limits
    from tvist_protocol.stream import Event, State, Truth

LONGEST = 300_000  # most rows that are kept: ten minutes of simulation
EVENTS = 10_000  # most events that are kept
EARLY = 256  # most truths that wait for the state of their tick


class HistoryRow:
    """Measured values at a tick."""

    __slots__ = (
        "acceleration", "moment", "moving", "pose", "q", "qd", "qdd", "tick", "time", "tool_speed", "true",
    )  # fmt: skip

    def __init__(self, state: "State") -> None:
        self.tick = state.tick
        self.time = state.timestamp  # simulation time [s]
        self.moving = state.runtime_state != RuntimeState.STOPPED  # true while the shaped reference moves
        self.q = array("d", state.actual_q)  # measured joint angles [rad]
        self.qd = array("d", state.actual_qd)  # measured joint velocities [rad/s]
        self.qdd = array("d", state.target_qdd)  # accelerations of the shaped reference [rad/s²]
        self.moment = array("d", state.actual_moment)  # measured joint torques [N m]
        self.tool_speed = array("d", state.actual_TCP_speed)
        """Velocity of the tool centre point [m/s], and its angular velocity [rad/s]."""
        self.true = False  # whether the truth of this tick is known
        self.pose = array("d", state.actual_TCP_pose)
        """Pose of the flexible arm's flange if known, else of the measured tool: x y z [m], rotation vector [rad]."""
        self.acceleration = array("d", state.actual_tool_accelerometer)
        """Specific force at the flange in its own frame, without noise if the truth is known [m/s²]."""

    def know(self, truth: "Truth") -> None:
        """Replace measurements of this tick by the truth."""
        self.true = True
        self.pose = array("d", truth.flange_pose)
        self.acceleration = array("d", truth.tool_acceleration)


class History:
    """The last ten minutes of a robot."""

    def __init__(self) -> None:
        self.joint_limits: Limits | None = None  # None before the robot was queried
        self.period = 0.002  # control period [s]
        self.rows: deque[HistoryRow] = deque(maxlen=LONGEST)
        self.events: deque[Event] = deque(maxlen=EVENTS)
        self._early: deque[Truth] = deque(maxlen=EARLY)

    def on_truth(self, truth: "Truth") -> None:
        """Add the truth of a tick, which may come before the state of its tick, or after later ones."""
        row = next((row for row in reversed(self.rows) if row.tick <= truth.tick), None)
        if row is not None and row.tick == truth.tick:
            row.know(truth)
        else:
            self._early.append(truth)

    def on_state(self, state: "State") -> None:
        """Add a state; ignore the one before the first tick, which contains no measurements."""
        if state.tick == 0:
            return
        row = HistoryRow(state)
        for truth in self._early:
            if truth.tick == row.tick:
                row.know(truth)
        while self._early and self._early[0].tick <= row.tick:
            self._early.popleft()
        self.rows.append(row)

    def since_rest(self) -> list[HistoryRow]:
        """Return the rows since the shaped reference last came to rest; all if it never moved.

        The flange of the flexible arm and the measured tool are different points. So if the truth of any of
        these ticks is known, rows without it are left out.
        """
        rows = [*takewhile(lambda row: not row.moving, reversed(self.rows))][::-1]
        return [row for row in rows if row.true] or rows

"""Numbered motions; parts, rate and pause of a planned motion in progress."""

import math
from typing import Unpack

import numpy as np

from tvist_controller.events import Emit, StopFields
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import STILL
from tvist_controller.line.limits import REDUCED_SHARE, acceleration_on_way, rate_of
from tvist_controller.motion.safety_system import SafetySystem
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.trajectory import Guided, PlannedMotion
from tvist_protocol.replies import Code

PAUSE_SHARE = 0.95
"""Fraction of the acceleration allowed by torque that a pause uses; the filter may add a little [-]."""
LEAST_PAUSE = 0.2
"""Smallest fraction of a motion's acceleration that torque must allow for a pause; otherwise it runs on [-]."""


class RunningMove:
    """One planned motion."""

    def __init__(self, planned: PlannedMove, cycle: ControlCycle) -> None:
        self._velocity, self._cycle = planned.velocity, cycle
        self._window, self._peak = planned.window, planned.peak
        self._room, self._excess_at_limits = planned.room, planned.excess_at_limits
        self._held = False
        self.extendable = planned.extendable  # from here its last part can be extended; None if not
        self._parts = len(planned.parts)
        self._trajectory, *coming = planned.parts
        self.coming: tuple[PlannedMotion, ...] = tuple(coming)  # parts that have not started
        self._begin()

    def go_on(self, speed: float, slowest: float | None) -> None:
        """Start the next part; arguments as in `Guided.pace`."""
        self._trajectory, *coming = self.coming
        self.coming, self._held = tuple(coming), False
        self._trajectory.speed = self._rate(speed, slowest)
        self._begin()

    @property
    def passed(self) -> float:
        """Time since the last part began; 0 before the last part [s]."""
        return 0.0 if self.coming else self._trajectory.time

    def extend(self, planned: PlannedMove, speed: float, slowest: float | None) -> None:
        """Continue to further parts of the path. The plan's first part extends the present last part."""
        longer, *coming = planned.parts
        if self.coming:
            self.coming = (*self.coming[:-1], longer, *coming)
            self._velocity = max(self._velocity, planned.velocity)
            self._window = min(self._window, planned.window)
        else:
            self._cycle.go_on(longer)
            self._velocity, self._window, self.coming = planned.velocity, planned.window, tuple(coming)
        self._peak, self.extendable = planned.peak, planned.extendable
        self._parts += len(coming)
        self.pace(speed, slowest)

    def _begin(self) -> None:
        self._cycle.begin(self._trajectory)
        self._cycle.tvist.aim(self._trajectory.path.end)

    def _rate(self, speed: float, slowest: float | None) -> float:
        """Return a time rate [-], lower for motions planned for a shaper with less delay, peak or excess."""
        tvist = self._cycle.tvist
        room = min(_fitting(self._window, tvist.delay), _fitting(self._peak, tvist.peak))
        if tvist.excess_at_limits != self._excess_at_limits:
            (velocity, acceleration), (more_velocity, more_acceleration) = self._room, tvist.excess_at_limits
            room = min(
                room, velocity / (1.0 + more_velocity), math.sqrt(acceleration / (1.0 + more_acceleration))
            )
        return min(rate_of(speed, self._velocity, slowest), room)

    @property
    def progress(self) -> tuple[int, float] | None:
        """Number of the present part, from 0, and length covered on it [m]; None for a joint-space line."""
        if self._trajectory.path.posture_of is None:
            return None
        return self._parts - 1 - len(self.coming), float(self._cycle.along.newest.q[0])

    @property
    def stops_at(self) -> tuple[int, float] | None:
        """`progress` where the arm will rest on the present part; None if it leaves the path."""
        forecast, present = self._cycle.trajectory.forecast, self.progress
        if present is None or forecast is None or forecast.path is not self._trajectory.path:
            return None
        if self._held and self._cycle.trajectory is self._trajectory:
            return present  # paused: the motion does not continue to its end
        return present[0], float(forecast.end[0])

    @property
    def rate(self) -> float:
        """Time rate [-]."""
        return self._trajectory.rate

    def pace(self, speed: float, slowest: float | None) -> None:
        """Change the rate unless paused; see `Guided.pace`."""
        if not self._held:
            self._trajectory.speed = self._rate(speed, slowest)

    def hold(self) -> None:
        """Pause within torque limits unless the motion ends sooner; see `PlannedMotion.hold`."""
        if self._held or self._cycle.mode.at_rest:  # at rest: the motion is between two parts
            return
        trajectory, cycle = self._trajectory, self._cycle
        most = trajectory.agility.acceleration
        newest = cycle.along.newest
        speed = max(trajectory.velocity, float(np.abs(newest.qd).max()))
        left = trajectory.bearing(newest.q)
        farthest = float(np.abs(left).max())
        way = left * min(speed * speed / (most * max(farthest, STILL)), 1.0)
        limits = np.array(cycle.description.limits.torque)
        room = PAUSE_SHARE * acceleration_on_way(
            cycle.dynamics, trajectory.path, newest.q, way, speed, limits
        )
        if not trajectory.steady:  # the slider is already changing its speed, possibly at full acceleration
            room = most
        self._held = room > LEAST_PAUSE * most and trajectory.hold(min(room, most))

    def release(self, speed: float, slowest: float | None) -> None:
        """Resume after a pause; see `Guided.pace`."""
        if self._held:
            self._trajectory.release(self._rate(speed, slowest))
        self._held = False


class Motions:
    """Starts one motion at a time; each number ends as done or stopped."""

    def __init__(self, cycle: ControlCycle, safety: SafetySystem, emit: Emit) -> None:
        self._cycle, self._safety, self._emit = cycle, safety, emit
        self._reduced_velocity = REDUCED_SHARE * min(cycle.description.limits.velocity)
        self._started = 0
        self._running: RunningMove | Guided | None = None
        self.asked_speed = 1.0  # set speed [-]
        self._scale = 1.0

    @property
    def running(self) -> bool:
        """Whether a motion is running."""
        return self._running is not None

    @property
    def wanted_speed(self) -> float:
        """Set speed times the robot's own slider [-]."""
        return self.asked_speed * self._scale

    @property
    def speed(self) -> float:
        """Time rate of the running motion, or of the next one [-]."""
        return self.wanted_speed if self._running is None else self._running.rate

    @property
    def slowest(self) -> float | None:
        """Joint velocity limit in reduced mode, else None [rad/s]."""
        return self._reduced_velocity if self._safety.reduced else None

    def begin(self, planned: PlannedMove) -> int:
        """Start a planned motion and return its number."""
        number = self._begin(RunningMove(planned, self._cycle))
        self._warn(planned)
        return number

    def extend(self, planned: PlannedMove) -> None:
        """Extend the running motion to further parts of its path, with a plan for the present state."""
        assert self.move is not None
        self.move.extend(planned, self.wanted_speed, self.slowest)
        self._warn(planned)

    def _warn(self, planned: PlannedMove) -> None:
        for why in planned.skipped:
            self._emit("warning", id=self._started, code="blend_skipped", why=why)
        if planned.limited is not None:
            code, why = planned.limited
            self._emit("warning", id=self._started, code=code, why=why)

    def guide(self, trajectory: Guided) -> int:
        """Start a guided motion and return its number; if it replaces a running one, it keeps that number."""
        trajectory.pace(self.wanted_speed, self.slowest)
        if self._running is None:
            return self._begin(trajectory)
        self._running = trajectory
        return self._started

    def _begin(self, motion: RunningMove | Guided) -> int:
        self._started += 1
        self._running = motion
        self._emit("motion_started", id=self._started)
        return self._started

    def go_on(self) -> bool:
        """After a part of the running motion has come to rest, start the next; return False without one."""
        move = self.move
        if move is None or not move.coming:
            return False
        move.go_on(self.wanted_speed, self.slowest)
        return True

    @property
    def move(self) -> RunningMove | None:
        """The running planned motion, if any."""
        return self._running if isinstance(self._running, RunningMove) else None

    def set_speed(self, fraction: float) -> None:
        """Set the time scale of running and later motions."""
        self.asked_speed = fraction
        self.keep_rate()

    def scale(self, share: float) -> None:
        """Scale the speed by the slider of a robot moved through its own controller [-]."""
        self._scale = share
        self.keep_rate()

    def keep_rate(self) -> None:
        """Adapt the running motion's rate to the set speed and the limits."""
        if self._running is not None:
            self._running.pace(self.wanted_speed, self.slowest)

    def done(self) -> None:
        """Report that the shaped reference rests at the target."""
        if self._running is not None:
            self._emit("motion_done", id=self._started)
            self._running = None

    def stopped(self, why: str, code: Code | None, **told: Unpack[StopFields]) -> None:
        """Report that the motion ended before its target."""
        if self._running is not None:
            self._emit("motion_stopped", id=self._started, code=code, why=why, **told)
            self._running = None


def _fitting(planned: float, present: float) -> float:
    """Return the time rate [-] that compensates a shaper property that is now larger than planned."""
    return 1.0 if present <= planned else planned / present

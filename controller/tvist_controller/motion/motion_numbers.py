"""Motions by number, and their speed."""

from typing import Unpack

from tvist_controller.commands.events import Emit, Told
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.limits import REDUCED_SHARE
from tvist_controller.motion.running_move import RunningMotion, RunningMove
from tvist_controller.motion.safety_system import SafetySystem
from tvist_controller.planning.course import Course
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.trajectory import Guided, PlannedMotion
from tvist_protocol.replies import Code


class Motions:
    """Starts motions, one at a time; each number ends in either done or stopped."""

    def __init__(self, cycle: ControlCycle, safety: SafetySystem, emit: Emit) -> None:
        self._cycle, self._safety, self._emit = cycle, safety, emit
        self._reduced_velocity = REDUCED_SHARE * min(cycle.description.limits.velocity)
        self._started = 0
        self._running: RunningMotion | None = None
        self.asked_speed = 1.0
        """Speed that was set [-]."""
        self._scale = 1.0

    @property
    def running(self) -> bool:
        """Whether a motion is running."""
        return self._running is not None

    @property
    def wanted_speed(self) -> float:
        """Speed that was set, as far as the robot's own slider lets it [-]."""
        return self.asked_speed * self._scale

    @property
    def speed(self) -> float:
        """Rate of the running motion's time; without one, that of the next motion [-]."""
        return self.wanted_speed if self._running is None else self._running.rate

    @property
    def slowest(self) -> float | None:
        """Largest velocity of a joint while the safety system reduces the speed [rad/s]; None while it does not."""
        return self._reduced_velocity if self._safety.reduced else None

    def begin(self, planned: PlannedMove) -> int:
        """Start a planned motion and return its number."""
        number = self._begin(RunningMove(planned, self._cycle))
        self._warn(planned)
        return number

    def extend(self, planned: PlannedMove) -> None:
        """Let the running motion go on to further parts of its path; the plan holds for the present state."""
        assert isinstance(self._running, RunningMove)
        self._running.extend(planned, self.wanted_speed, self.slowest)
        self._warn(planned)

    def _warn(self, planned: PlannedMove) -> None:
        for why in planned.skipped:
            self._emit("warning", id=self._started, code="blend_skipped", why=why)
        if planned.limited is not None:
            code, why = planned.limited
            self._emit("warning", id=self._started, code=code, why=why)

    def guide(self, trajectory: Guided) -> int:
        """Return the number of a guided motion, which is that of its predecessor if there is one."""
        trajectory.pace(self.wanted_speed, self.slowest)
        if self._running is None:
            return self._begin(trajectory)
        self._running = trajectory
        return self._started

    def _begin(self, motion: RunningMotion) -> int:
        self._started += 1
        self._running = motion
        self._emit("motion_started", id=self._started)
        return self._started

    def go_on(self) -> bool:
        """Start the next part of the running motion, since one has come to rest; return whether there was one."""
        if not self.coming:
            return False
        assert isinstance(self._running, RunningMove)
        self._running.go_on(self.wanted_speed, self.slowest)
        return True

    @property
    def coming(self) -> tuple[PlannedMotion, ...]:
        """Parts of the running motion that have not begun."""
        return self._running.coming if isinstance(self._running, RunningMove) else ()

    @property
    def course(self) -> tuple[Course | None, float]:
        """What the running motion may go on from, and its time [s]; None if it cannot go on."""
        return self._running.course if isinstance(self._running, RunningMove) else (None, 0.0)

    @property
    def progress(self) -> tuple[int, float] | None:
        """Number of the running motion's present part, and the length covered on it [m]; None if it has no length."""
        return self._running.progress if isinstance(self._running, RunningMove) else None

    @property
    def stops_at(self) -> tuple[int, float] | None:
        """Progress at which a stop of the running motion ends; None if no stop on its path has begun."""
        return self._running.stops_at if isinstance(self._running, RunningMove) else None

    def set_speed(self, fraction: float) -> None:
        """Scale the time of the running motion and of later ones."""
        self.asked_speed = fraction
        self.keep_rate()

    def scale(self, share: float) -> None:
        """Scale that speed, too, by the slider of a robot that is moved through its own controller [-]."""
        self._scale = share
        self.keep_rate()

    def keep_rate(self) -> None:
        """Let the running motion continue at the rate that is set and allowed."""
        if self._running is not None:
            self._running.pace(self.wanted_speed, self.slowest)

    def hold(self) -> None:
        """Bring a planned motion to a standstill on its path."""
        if isinstance(self._running, RunningMove):
            self._running.hold()

    def release(self) -> None:
        """Resume a planned motion."""
        if isinstance(self._running, RunningMove):
            self._running.release(self.wanted_speed, self.slowest)

    def done(self) -> None:
        """Report that the shaped reference has come to rest at the motion's target."""
        if self._running is not None:
            self._emit("motion_done", id=self._started)
            self._running = None

    def stopped(self, why: str, code: Code | None, **told: Unpack[Told]) -> None:
        """Report that the motion ended before its target."""
        if self._running is not None:
            self._emit("motion_stopped", id=self._started, code=code, why=why, **told)
            self._running = None

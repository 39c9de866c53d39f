"""Point-to-point motions by number, and their speed."""

from typing import Unpack

from tvist_controller.cycle import ControlCycle
from tvist_controller.events import Emit, Told
from tvist_controller.moving import RunningMove
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.safety import REDUCED_SHARE, rate_of
from tvist_controller.safety_system import SafetySystem
from tvist_controller.trajectory import PlannedMotion
from tvist_protocol.replies import Code


class Motions:
    """Starts motions, one at a time; each number ends in either done or stopped.

    Args:
        cycle: The control line.
        safety: The safety system.
        emit: Emits events.
    """

    def __init__(self, cycle: ControlCycle, safety: SafetySystem, emit: Emit) -> None:
        self._cycle, self._safety, self._emit = cycle, safety, emit
        self._reduced_velocity = REDUCED_SHARE * min(cycle.description.limits.velocity)
        self._started = 0
        self._move: RunningMove | None = None
        self.wanted_speed = 1.0
        """Speed that was set [-]."""

    @property
    def running(self) -> bool:
        """Whether a motion is running."""
        return self._move is not None

    @property
    def speed(self) -> float:
        """Rate of the running motion's time; without one, that of the next motion [-]."""
        return self.wanted_speed if self._move is None else self._move.rate

    @property
    def slowest(self) -> float | None:
        """Largest velocity of a joint while the safety system reduces the speed [rad/s]; None while it does not."""
        return self._reduced_velocity if self._safety.reduced else None

    def begin(self, planned: PlannedMove) -> int:
        """Start a motion and return its number."""
        self._started += 1
        move = self._move = RunningMove(self._started, planned, self._cycle)
        self._emit("motion_started", id=move.number)
        for why in planned.skipped:
            self._emit("warning", id=move.number, code="blend_skipped", why=why)
        if planned.excess_of_torque is not None:
            self._emit("warning", id=move.number, code="limit_torque", why=planned.excess_of_torque)
        return move.number

    def go_on(self) -> bool:
        """Start the next part of the running motion, since one has come to rest; return whether there was one."""
        move = self._move
        if move is None or not move.coming:
            return False
        move.go_on(self._rate(move))
        return True

    @property
    def coming(self) -> tuple[PlannedMotion, ...]:
        """Parts of the running motion that have not begun."""
        return () if self._move is None else self._move.coming

    def set_speed(self, fraction: float) -> None:
        """Scale the time of the running motion and of later ones."""
        self.wanted_speed = fraction
        self.keep_rate()

    def keep_rate(self) -> None:
        """Let the running motion continue at the rate that is set and allowed."""
        if self._move is not None:
            self._move.go(self._rate(self._move))

    def hold(self) -> None:
        """Bring the motion to a standstill on its path."""
        if self._move is not None:
            self._move.hold()

    def release(self) -> None:
        """Resume the motion."""
        if self._move is not None:
            self._move.release(self._rate(self._move))

    def done(self) -> None:
        """Report that the shaped reference has come to rest at the motion's target."""
        if self._move is not None:
            self._emit("motion_done", id=self._move.number)
            self._move = None

    def stopped(self, why: str, code: Code | None, **told: Unpack[Told]) -> None:
        """Report that the motion ended before its target."""
        if self._move is not None:
            self._emit("motion_stopped", id=self._move.number, code=code, why=why, **told)
            self._move = None

    def _rate(self, move: RunningMove) -> float:
        """Rate of a motion's time [-]."""
        return min(rate_of(self.wanted_speed, move.velocity, self.slowest), move.highest_rate)

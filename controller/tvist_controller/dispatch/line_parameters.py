"""Payload (declared or learnt) and filter that the control line uses."""

from collections.abc import Callable
from typing import Any

from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.kinematics.arm import SLEW
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.planning.filter_planner import FilterChoice
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.refusal import RefusalError
from tvist_controller.safety.payload_monitor import PayloadMonitor
from tvist_controller.setup import body, payload_of
from tvist_controller.sources.calibrations import fits
from tvist_controller.sources.mode_source import ModeSource
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import SetPayload
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter


class LineParameters:
    """The control line's payload and filter, changed without disturbing the motion."""

    def __init__(
        self,
        payload: Payload,
        source: ModeSource,
        motion: MotionControl,
        peripherals: Peripherals,
        plan: Callable[[PayloadLesson, FilterState], Plan],  # plans the change that a lesson requires
        emit: Emit,
        *,
        follows: bool,  # whether the robot learns its payload from its motions
    ) -> None:
        self.declared = payload
        self.assumed = payload  # payload for dynamics and modes: the declared or the learnt one
        self.source = source
        self._motion, self._cycle, self._peripherals = motion, motion.cycle, peripherals
        self._plan, self._emit = plan, emit
        self.monitor = PayloadMonitor(motion.cycle.description, body(payload), follows=follows)
        """Compares the payload with the drives' torques."""
        self._warn_of_payload()
        self._warn_of_arm()

    def present(self) -> FilterState:
        """Return the present state that a new filter depends on."""
        tvist = self._cycle.tvist
        return FilterState(tvist.name, tvist.estimator.modes, self.source, self.assumed, self.declared)

    # ------------------------------------------------------------------ filter

    def choose(self, chosen: FilterChoice) -> None:
        """Use a filter from now on; raise RefusalError if the rest of the motion would then collide."""
        self._motion.ahead.check_filter(chosen.tvist)
        self.use(chosen)

    def estimate(self, chosen: FilterChoice) -> None:
        """Choose a filter with modes from another estimator; warn if they do not suit the payload."""
        self.choose(chosen)
        self._warn_of_payload()

    def use(self, chosen: FilterChoice) -> None:
        """Use a filter from now on."""
        before, idle = self.source, self._idle
        self.source = chosen.source
        self._cycle.drives.law = chosen.law
        self._cycle.use(chosen.tvist, chosen.elastic)
        self._motion.motions.keep_rate()
        self._emit("shaper_changed", why=f"{chosen.tvist.name} with estimator {self.source.name}")
        if self.source is not before:
            self._warn_of_arm()
        if idle:
            self._warn_of_payload()

    # ------------------------------------------------------------------ payload

    def learn(self, lesson: PayloadLesson, plan: Plan | None = None) -> None:
        """At rest, use the payload of a lesson, with a plan made in advance if that is still valid."""
        present = self.present()
        if plan is None or plan.state != {"filter": present}:
            plan = self._plan(lesson, present)
        found: Any = plan.found
        if isinstance(found, RefusalError):
            self._emit("warning", why=f"{lesson.why}; it is not assumed: {found.reply.why}")
            return
        self._assume(lesson.payload, found, SLEW, told=lesson.beyond)
        self._emit("learnt", why=lesson.why)
        if lesson.beyond:
            self._emit("warning", code="payload_mismatch", why=lesson.why)
        self._peripherals.changed = True

    def declare(self, command: SetPayload, tvist: Filter | None) -> None:
        """Take another declared payload, with the filter planned for it."""
        payload = payload_of(command)
        self._clear_with(payload, tvist)
        self.declared = payload
        self._assume(payload, tvist, max(round(command.transition_time / PERIOD), SLEW))

    def forget(self, planned: Callable[[], Any]) -> None:
        """Return to the declared payload, with the filter planned for it."""
        if self.assumed == self.declared:
            return
        tvist = planned()
        self._clear_with(self.declared, tvist)
        self._assume(self.declared, tvist, SLEW)
        self._emit("learnt", why=f"the declared {self.declared.mass:g} kg are assumed again")

    def _clear_with(self, payload: Payload, tvist: Filter | None) -> None:
        """Put a payload in the collision model; RefusalError if the rest of the motion would then collide."""
        move = self._motion.motions.move
        self._motion.ahead.check_payload(body(payload), tvist, () if move is None else move.coming)

    def _assume(self, payload: Payload, tvist: Filter | None, ticks: int, *, told: bool = False) -> None:
        """Phase in a payload, and its filter if any; `told`: clients are warned of an overload separately."""
        self.assumed, carried = payload, body(payload)
        self._cycle.dynamics.declare(carried, ticks)
        if tvist is not None:
            self._cycle.use(tvist, self._cycle.drives.wanted)
            self._motion.motions.keep_rate()
        self._warn_of_payload()
        self.monitor.declare(carried, ticks, found=payload is not self.declared, told=told)

    @property
    def _idle(self) -> bool:
        """Whether shaping is off, so that vibration modes have no effect."""
        return self._cycle.tvist.name == "none"

    def _warn_of_payload(self) -> None:
        assumed, word = self.assumed, "declared" if self.assumed == self.declared else "carried"
        calibration = self.source.calibration
        if not self._idle and calibration is not None and not fits(calibration, assumed, self.source.name):
            self._emit(
                "warning",
                code="payload_mismatch",
                why=f"calibration {calibration.name!r} was made with "
                f"{calibration.payload.mass:g} kg; {assumed.mass:g} kg is {word}: "
                "the shaper's frequencies will be wrong. Take a modal calibration, which knows any payload, or "
                "identify the arm with this one",
            )

    def _warn_of_arm(self) -> None:
        calibration = self.source.calibration
        if calibration is not None and self.source.fits_arm is False:
            why = (
                f"calibration {calibration.name!r} was measured on a different arm than the one in the robot file: "
                "the shaper's frequencies will be wrong; measure this arm with tvist identify"
            )
            self._emit("warning", why=why)

"""The robot's activities: carries out the transitions of `tvist_protocol.transitions`."""

from collections import deque
from typing import Unpack

import numpy as np
from msgspec.structs import replace

from tvist_controller.events import Emit, StopFields
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.foresight.rest_of_motion import RemainingMotion
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import StopPlan
from tvist_controller.kinematics.arm import Arm
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import StreamTorqueMargin
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.arm_power import ArmPower
from tvist_controller.motion.motions import Motions
from tvist_controller.motion.safety_system import PUT, RUNTIME, SafetySystem
from tvist_controller.motion.setpoints import Setpoints
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.snapshot import FilterState, PlanningState
from tvist_controller.refusal import invalid, out_of_turn, wrong_mode
from tvist_controller.trajectory import MotionLimits, SetpointStream
from tvist_protocol.modes import RuntimeState, SafetyMode
from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind
from tvist_protocol.transitions import Activity, after
from tvist_protocol.values import ResetMode
from tvist_urscript import Script

HISTORY = 1000  # number of past postures kept (2 s)
STEADY = 250  # ticks of rest after which the arm counts as steady (500 ms, as on UR robots)


class MotionControl:
    """Starts, monitors and ends motion on the control line; each numbered motion ends as done or stopped."""

    def __init__(
        self, cycle: ControlCycle, collisions: CollisionModel, emit: Emit, mode: ResetMode = "RUNNING"
    ) -> None:
        self.cycle = cycle
        self.collisions = collisions
        self.changed = True  # whether activity or modes may have changed since `RobotModes.update`
        self.activity = PUT[mode]
        self.safety = SafetySystem()
        self._emit = emit
        self.stopper = Stopper(cycle)  # prediction and stops of the control line's motion
        self.ahead = RemainingMotion(cycle, self.stopper, collisions)  # collision check of that motion
        self.power = ArmPower.of(cycle.plant)  # power of a real arm; None for simulated arms
        self.motions = Motions(cycle, self.safety, emit)
        self.streams = Setpoints(cycle.description)  # the present stream of set-points, if any
        self.tcp: tuple[float, ...] = (0.0,) * 6
        """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
        self.tool = Arm(cycle.description)
        """Kinematics with that TCP; shared by threads, so replaced instead of changed."""
        self.past = deque[Floats](maxlen=HISTORY)
        """Measured postures since the arm was placed, newest last [rad]."""
        self._still = 0

    @property
    def activity(self) -> Activity:
        """Present activity of the robot."""
        return self._activity

    @activity.setter
    def activity(self, activity: Activity) -> None:
        # Cache what every tick reads.
        self._activity, self._moving, self.robot_mode = activity, activity.moving, activity.robot_mode
        self.changed = True

    def set_tcp(self, offset: tuple[float, ...]) -> None:
        """Set the tool centre point for motions that start from now on; see `tcp`."""
        self.tcp, self.tool = offset, self.tool.with_tool(offset)

    @property
    def streaming(self) -> bool:
        """Whether the robot follows a stream of set-points."""
        return self.streams.stream is not None

    def snapshot(self, filter_now: FilterState, script: Script | None, time: float | None) -> PlanningState:
        """Return the state for plans from rest or, with `time` [s], for extending the motion after it."""
        cycle = self.cycle
        tvist = cycle.tvist
        now = PlanningState(
            filter=filter_now,
            movable=after(self.activity, "move_j") is not None,
            q=cycle.sample.reference,
            speed=self.motions.wanted_speed,
            slowest=self.motions.slowest,
            excess=tvist.excess,
            excess_at_limits=tvist.excess_at_limits,
            tcp=self.tcp,
            body=self.collisions.declared,
            bodies=cycle.dynamics.bodies,
            script=script,
        )
        if time is None:
            return now
        move = self.motions.move
        if move is None or move.extendable is None or self.activity not in {Activity.MOVING, Activity.PAUSED}:
            return replace(now, movable=False)
        # Its time rate is 1, independent of the running motion.
        return replace(
            now,
            movable=True,
            q=move.extendable.end,
            speed=1.0,
            slowest=None,
            after=move.extendable,
            until=move.passed + time,
        )

    def move(self, planned: PlannedMove) -> int:
        """Start a motion permitted by `check`, with a plan for the present state; return its number."""
        self.activity = Activity.MOVING
        return self.motions.begin(planned)

    def pause(self) -> None:
        """Pause the motion on its path, unless it is about to end; raise RefusalError if none runs."""
        self.go("pause")
        if (move := self.motions.move) is not None:
            move.hold()

    def resume(self) -> None:
        """Resume a paused motion; raise RefusalError if none is paused."""
        self.go("resume")
        if (move := self.motions.move) is not None:
            move.release(self.motions.wanted_speed, self.motions.slowest)

    @property
    def runtime(self) -> RuntimeState:
        """Runtime state; a paused motion that still slows down is pausing."""
        if self.activity is Activity.PAUSED and self.motions.speed > 0.0 and not self.cycle.mode.at_rest:
            return RuntimeState.PAUSING
        return RUNTIME.get(self.activity, RuntimeState.STOPPED)

    @property
    def safety_mode(self) -> SafetyMode:
        """Present safety mode."""
        return self.safety.mode(self.activity)

    @property
    def ready(self) -> bool:
        """Whether the drives hold the arm; always true for simulated arms."""
        return self.power is None or self.power.condition.ready

    def protect(self, why: str, code: Code | None = None) -> None:
        """Make a protective stop, unless the brakes hold the arm or it is being powered off."""
        if after(self.activity, "protective_stop") is not None:
            self.end("protective_stop", why, code, kind="protective_stop")

    def check(self, trigger: str) -> Activity:
        """Return the activity that a trigger leads to, or raise RefusalError if it is not allowed now."""
        if (target := after(self.activity, trigger)) is None:
            raise out_of_turn(trigger, self.activity)
        self.safety.check(trigger, self.activity)
        if target.moving and not (self._moving or self.ready):
            raise wrong_mode("the drives of the arm are not ready: wait until they hold it")
        return target

    def go(self, trigger: str) -> None:
        """Carry out the transition of a trigger, if `check` permits."""
        self.activity = self.check(trigger)

    def follow(self, period: float, limits: MotionLimits, now: float) -> None:
        """Start to follow set-points; RefusalError if busy, or `limits` exceed the reduced velocity limit."""
        target = self.check("servo_start")
        if (most := self.motions.slowest) is not None and limits.velocity > most:
            must = f"at most {most:.3g} rad/s while safety_mode is REDUCED"
            raise invalid("velocity", f"{limits.velocity:g} rad/s", must, most, "limit_velocity")
        self.activity = target
        self.streams.begin(self._stream(period, limits), now)

    def _stream(self, period: float, limits: MotionLimits) -> SetpointStream:
        """Make the line follow set-points with an interval of `period` seconds, from rest."""
        cycle = self.cycle
        cycle.tvist.aim(None)
        stream = SetpointStream(
            cycle.sample.reference,
            period,
            cycle.filter.reduced_limits(limits),
            reach=np.array(cycle.description.limits.position),
            torque=StreamTorqueMargin(cycle.description, cycle.dynamics),
        )
        return cycle.begin(stream, LineMode.GUARDED, self.ahead.guard_of_stream())

    def end_stream(self) -> None:
        """Bring the stream to rest through the filter; raise RefusalError if none runs."""
        if (stream := self.streams.stream) is None:
            raise out_of_turn("servo_stop", self.activity)
        end = stream.end
        if (met := self.ahead.after_stream(end)) is not None:
            self.interrupt(f"{met} before the stream came to rest through the filter", "collision")
            return
        self.go("servo_stop")
        self.cycle.begin(end, LineMode.GUARDED)
        self._end_stream("servo_stop")

    def stop(self, deceleration: float | None, why: str, code: Code | None = None) -> None:
        """Stop without the filter, at most at a deceleration [rad/s^2], and report how the motion ended."""
        self.end("stop", why, code, deceleration)

    def interrupt(self, why: str, code: Code | None = None) -> None:
        """End motion that must not continue, as `stop` does."""
        self.end("interruption", why, code)

    def end(
        self,
        trigger: str,
        why: str,
        code: Code | None = None,
        deceleration: float | None = None,
        *,
        kind: EventKind | None = None,
        category: int = 2,
    ) -> None:
        """If the trigger has a transition now, make it and stop motion; report this by an event of `kind`."""
        if (target := after(self.activity, trigger)) is None:
            return
        self.activity = target
        plan = None if self.cycle.mode.at_rest else self.stopper.stop(deceleration)
        if plan is not None and plan.limited:
            kept = "the motion's own" if plan.acceleration is None else f"{plan.acceleration:.3g} rad/s²"
            why = f"{why}; deceleration is {kept}, limited from {deceleration:.3g}"
        bare = not self.motions.running  # the end of a numbered motion reports the limit itself
        self.tell_end(plan, why, code, kind, category)
        if bare and plan is not None and plan.limited:
            self._emit("warning", code="limit_acceleration", why=why)

    def tell_end(
        self,
        plan: StopPlan | None,
        why: str,
        code: Code | None,
        kind: EventKind | None = None,
        category: int = 2,
    ) -> None:
        """Report a stop and the motion it ends; `plan` is None if the line is at rest or already stopping."""
        if kind is None and not self.motions.running and not self.streaming:
            return
        duration, way = (0.0, 0.0) if self.cycle.mode.at_rest else self.ahead.until_rest(plan)
        told = StopFields(category=category, duration=duration, way=way)
        if kind is not None:
            self._emit(kind, code=code, why=why, **told)
        self._end_stream(why, code, **told)
        self.motions.stopped(why, code, **told)

    def abandon(self, why: str, code: Code | None = None) -> None:
        """Report that the present motion has ended without a stop, as when the arm is placed elsewhere."""
        self._end_stream(why, code)
        self.motions.stopped(why, code)

    def watch(self, now: float) -> None:
        """End a stream without new set-points."""
        if (silence := self.streams.silence(now)) is not None:
            self.interrupt(silence)

    def step(self, wrench: Floats | None = None) -> Sample:
        """Compute one tick, see `ControlCycle.step`. After a PlantError, call `SafetyControl.recover`."""
        if self.power is not None:
            self.power.follow(self.robot_mode)
        sample = self.cycle.step(wrench)
        # The guard refused a reference, so the line has begun a stop.
        interrupted = None if sample.refused is None else after(self.activity, "interruption")
        if sample.refused is not None and interrupted is not None:
            self.activity = interrupted
            self.tell_end(None, *sample.refused)
        if self._moving and self.cycle.mode.at_rest and (target := after(self.activity, "at_rest")):
            goes_on = self.activity is Activity.MOVING and self.motions.go_on()
            if not goes_on:
                self.activity = target
                self.motions.done()
        return sample

    def note(self, sample: Sample) -> None:
        """Record a tick."""
        self.past.append(sample.measured.q)
        self._still = self._still + 1 if self.cycle.mode.at_rest else 0

    @property
    def steady(self) -> bool:
        """Whether the target has rested for half a second since the arm was placed."""
        return min(self._still, len(self.past)) >= STEADY

    def _end_stream(self, why: str, code: Code | None = None, **told: Unpack[StopFields]) -> None:
        if self.streams.end():
            self._emit("stream_stopped", code=code, why=why, **told)

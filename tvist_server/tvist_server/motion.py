"""What the robot is doing: motions by their numbers, streams of set-points, stops, power and protective stops.

`tvist_protocol.transitions` says what leads where; here it is done.
"""

from typing import Unpack

import numpy as np

from tvist_plant.plant import PERIOD, PlantError
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind
from tvist_protocol.transitions import Activity, after
from tvist_protocol.values import ResetMode
from tvist_server.brakes import brake
from tvist_server.collision import CollisionModel
from tvist_server.control.differentiator import Floats
from tvist_server.cycle import ControlCycle, Sample
from tvist_server.events import Emit, Told
from tvist_server.moving import Move
from tvist_server.outlook import Outlook
from tvist_server.overload import Overload
from tvist_server.planning.basis import FilterBasis, MotionBasis
from tvist_server.planning.move_planner import PlannedMove
from tvist_server.refusal import RefusalError, out_of_turn
from tvist_server.safety import REDUCED_SHARE
from tvist_server.safety_system import SafetySystem
from tvist_server.stops import StopPlan
from tvist_server.streaming import Streaming
from tvist_server.trajectory import Limits
from tvist_server.way_ahead import WayAhead

_PUT: dict[ResetMode, Activity] = {
    "RUNNING": Activity.REST,
    "IDLE": Activity.IDLE,
    "POWER_OFF": Activity.POWER_OFF,
}
_RUNTIME = {
    Activity.MOVING: RuntimeState.PLAYING,
    Activity.STREAMING: RuntimeState.PLAYING,
    Activity.ENDING: RuntimeState.PLAYING,
    Activity.PAUSED: RuntimeState.PAUSED,
    Activity.STOPPING: RuntimeState.STOPPING,
    Activity.POWERING_OFF: RuntimeState.STOPPING,
    Activity.BRAKING: RuntimeState.STOPPING,
    Activity.PROTECTIVE_STOPPING: RuntimeState.STOPPING,
}
"""All else is STOPPED."""


class MotionControl:
    """Starts, watches and ends motion on the control line. Every motion's number ends in one of done and stopped.

    Args:
        cycle: The control line.
        collisions: Where the arm would meet something.
        emit: Takes what happens.
        mode: Robot mode to start in.
    """

    def __init__(
        self, cycle: ControlCycle, collisions: CollisionModel, emit: Emit, mode: ResetMode = "RUNNING"
    ) -> None:
        self.cycle = cycle
        self.collisions = collisions
        self.activity = _PUT[mode]
        """What the robot is doing."""
        self.safety = SafetySystem()
        """What the safety system allows."""
        self._emit = emit
        self.outlook = Outlook(cycle)
        """What the control line is going to do."""
        self.ahead = WayAhead(cycle, self.outlook, collisions)
        """What would meet on its way."""
        limits = cycle.description.limits
        self._overload = Overload(limits.torque)
        self._reduced_velocity = REDUCED_SHARE * min(limits.velocity)
        self._started = 0
        self._move: Move | None = None
        self._speed = 1.0
        self._streaming = Streaming()

    @property
    def streaming(self) -> bool:
        """Whether a stream of set-points is followed."""
        return self._streaming.stream is not None

    @property
    def sequence(self) -> int | None:
        """Newest set-point taken in; None without a stream, or before its first."""
        stream = self._streaming.stream
        return None if stream is None else stream.sequence

    def counters(self) -> tuple[int, int, int]:
        """Late, lost and limited set-points since the start, the running stream's included."""
        return self._streaming.counters()

    def check_move(self) -> None:
        """Check that a point-to-point motion may begin.

        Raises:
            RefusalError: The arm is busy, without power or stopped for safety.
        """
        self._check("move_j")

    @property
    def may_move(self) -> bool:
        """Whether what the robot is doing lets a point-to-point motion begin."""
        return after(self.activity, "move_j") is not None

    def basis(self, on: FilterBasis) -> MotionBasis | None:
        """What a point-to-point motion from here depends on; None where the arm is busy or without power.

        Args:
            on: The present filter.
        """
        if not self.may_move:
            return None
        cycle = self.cycle
        return MotionBasis(
            q=cycle.reference,
            speed=self._speed,
            slowest=self._reduced_velocity if self.safety.reduced else None,
            excess=cycle.tvist.excess,
            carried=self.collisions.carried,
            bodies=cycle.inverse_dynamics.bodies,
            filter=on,
        )

    def move(self, planned: PlannedMove) -> int:
        """Start a point-to-point motion that was planned on what is so now; its number.

        Raises:
            RefusalError: As `check_move`.
        """
        self._go("move_j")
        trajectory = planned.trajectory
        self.cycle.start(trajectory)
        self.cycle.tvist.aim(trajectory.path.end)
        self._started += 1
        move = self._move = Move(self._started, trajectory, planned.velocity, self.cycle)
        self._emit("motion_started", id=move.number)
        if planned.excess_of_torque is not None:
            self._emit("warning", id=move.number, code="limit_torque", why=planned.excess_of_torque)
        return move.number

    def set_speed(self, fraction: float) -> None:
        """Scale the time of motions, the one that runs and those to come; streams keep their client's time."""
        self._speed = fraction
        self._set_rate()

    def pause(self) -> None:
        """Bring the motion to a standstill on its way; one that is about to end anyway goes on to its end.

        Raises:
            RefusalError: None is running.
        """
        self._go("pause")
        if self._move is not None:
            self._move.hold()

    def resume(self) -> None:
        """Go on with a motion that was paused.

        Raises:
            RefusalError: None is.
        """
        self._go("resume")
        if self._move is not None:
            self._move.release(self._rate(self._move.velocity))

    @property
    def speed(self) -> float:
        """Rate of the running motion's time; without one, that of the next [-]."""
        return self._speed if self._move is None else self._move.rate

    @property
    def wanted_speed(self) -> float:
        """What the speed was set to [-]."""
        return self._speed

    @property
    def runtime(self) -> RuntimeState:
        """Whether something moves."""
        state = _RUNTIME.get(self.activity, RuntimeState.STOPPED)
        pausing = state is RuntimeState.PAUSED and self.speed > 0.0 and not self.cycle.at_rest
        return RuntimeState.PAUSING if pausing else state

    @property
    def safety_mode(self) -> SafetyMode:
        """What the safety system allows."""
        return self.safety.mode(self.activity)

    def _rate(self, velocity: float) -> float:
        """Rate for the time of a motion with this velocity limit [-]."""
        return min(self._speed, self._reduced_velocity / velocity) if self.safety.reduced else self._speed

    def _set_rate(self) -> None:
        if self._move is not None:
            self._move.go(self._rate(self._move.velocity))

    def reduce(self, *, reduced: bool) -> None:
        """Slow motions down on their way, or let them go on; a stream, whose time is its client's, is stopped."""
        self.safety.reduced = reduced
        self._set_rate()
        stream = self._streaming.stream
        if reduced and stream is not None and stream.limits.velocity > self._reduced_velocity:
            self.stop(None, "speed was reduced", "limit_velocity")

    def power_on(self, *, release_brakes: bool = True) -> None:
        """Power the arm and release its brakes.

        Args:
            release_brakes: False: leave the brakes of an arm without power.

        Raises:
            RefusalError: It moves, or is in a protective stop.
        """
        self._go("power_on" if release_brakes else "power")

    def brake(self, why: str) -> None:
        """Stop by category 0: the power is gone, and the brakes close at once.

        Args:
            why: The reason, for a person.
        """
        target, plan, cycle = after(self.activity, "brakes"), None, self.cycle
        if target is not None:
            self.activity = target
        if target is not None and not cycle.at_rest:
            stop = brake(cycle.description, cycle.arm.payload, cycle.newest, PERIOD)
            way = float(np.abs(stop.end - cycle.position).max())
            plan = StopPlan(None, None, limited=False, duration=stop.duration, way=way)
            self.outlook.brake(stop)
        self._tell_end(plan, why, None, "safety_stop", 0)

    def until_rest(self) -> tuple[float | None, float | None]:
        """How long it takes until the shaped reference rests [s], and how far it goes [rad]; see `WayAhead`."""
        return self.ahead.until_rest()

    def power_off(self) -> None:
        """Stop what moves, then take the power; the brakes hold the arm where it is."""
        self.end("power_off", "power_off was commanded", category=1)

    def protect(self, why: str, code: Code | None = None) -> None:
        """Make a protective stop; nothing happens where the brakes hold the arm or power is on its way out."""
        if after(self.activity, "protective_stop") is not None:
            self.end("protective_stop", why, code, kind="protective_stop")

    def unlock(self) -> None:
        """Leave a protective stop.

        Raises:
            RefusalError: There is none, or the arm is still stopping.
        """
        self._go("unlock_protective_stop")
        self._overload.forget()

    def recover(self, error: PlantError, seed: int) -> Sample:
        """Put an arm whose state was no longer finite at rest where its reference was, in a protective stop.

        Args:
            error: What the arm said.
            seed: Of its noise and gear errors.

        Returns:
            A tick of the line with it.
        """
        why = f"{error}: the simulation put it at rest where its reference was"
        self.abandon(why, "plant_failure")
        self.cycle.reset(self.cycle.position, seed=seed)
        self._overload.forget()
        if after(self.activity, "plant_failure") is not None:
            self._go("plant_failure")
        self._emit("protective_stop", code="plant_failure", why=why)
        return self.cycle.step()

    def _check(self, trigger: str) -> Activity:
        """What a trigger leads to.

        Raises:
            RefusalError: Nowhere, from here.
        """
        target = after(self.activity, trigger)
        if target is None:
            raise out_of_turn(trigger, self.activity)
        self.safety.check(trigger, self.activity)
        return target

    def _go(self, trigger: str) -> None:
        self.activity = self._check(trigger)

    def follow(self, period: float, limits: Limits, now: float) -> None:
        """Start to follow set-points.

        Raises:
            RefusalError: The arm is busy, or such a stream may be too fast.
        """
        target = self._check("servo_start")
        if self.safety.reduced and limits.velocity > (most := self._reduced_velocity):
            why = f"velocity is {limits.velocity:g} rad/s; safety_mode is REDUCED, which leaves {most:.3g}"
            raise RefusalError("limit_velocity", "velocity", why, most)
        self.activity = target
        self._streaming.begin(self.cycle.stream(period, limits), now)
        self.ahead.begin()

    def offer(self, sequence: int, q: Floats, now: float) -> None:
        """Take a set-point of the running stream."""
        self._streaming.offer(sequence, q, now)

    def refuse_setpoint(self, why: str) -> None:
        """Remember why a set-point was not taken, for the event that says that none came."""
        self._streaming.refuse(why)

    def end_stream(self) -> None:
        """Bring the stream to rest through the filter.

        Raises:
            RefusalError: None is running.
        """
        stream = self._streaming.stream
        if stream is None:
            raise out_of_turn("servo_stop", self.activity)
        end = self.cycle.end_of(stream)
        met = self.ahead.after_stream(end)
        if met is not None:
            self.interrupt(f"{met} before the stream came to rest through the filter", "collision")
            return
        self._go("servo_stop")
        self.cycle.start(end)
        self._end_stream("servo_stop")

    def stop(self, deceleration: float | None, why: str, code: Code | None = None) -> None:
        """Stop past the filter, and say how what was moving ended.

        Args:
            deceleration: Wanted limit [rad/s^2]; None for what the torque allows.
            why: The reason, for a person.
            code: The reason, for a program.
        """
        self.end("stop", why, code, deceleration)

    def interrupt(self, why: str, code: Code | None = None) -> None:
        """End motion that may not go on, as `stop` does."""
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
        """Go where a trigger leads, and stop on the way what moves. One that leads nowhere is none of ours.

        Args:
            trigger: Of the table.
            why: The reason, for a person.
            code: The reason, for a program.
            deceleration: Wanted limit [rad/s^2]; None for what the torque allows.
            kind: Of an event that tells of the stop itself; None for none.
            category: Of the stop.
        """
        target = after(self.activity, trigger)
        if target is None:
            return
        self.activity = target
        plan = None if self.cycle.at_rest else self.outlook.stop(deceleration)
        if plan is not None and plan.limited:
            kept = "the motion's own" if plan.acceleration is None else f"{plan.acceleration:.3g} rad/s²"
            why = f"{why}; deceleration is {kept}, limited from {deceleration:.3g}"
        bare = self._move is None  # what has no number ends without a word on limits
        self._tell_end(plan, why, code, kind, category)
        if bare and plan is not None and plan.limited:
            self._emit("warning", code="limit_acceleration", why=why)

    def _tell_end(
        self, plan: StopPlan | None, why: str, code: Code | None, kind: EventKind | None, category: int
    ) -> None:
        """Tell of a stop, and of what it has ended."""
        if kind is None and self._move is None and not self.streaming:
            return
        duration, way = (0.0, 0.0) if self.cycle.at_rest else self.ahead.until_rest(plan)
        told = Told(category=category, duration=duration, way=way)
        if kind is not None:
            self._emit(kind, code=code, why=why, **told)
        self._end_stream(why, code, **told)
        self._end_motion(why, code, **told)

    def abandon(self, why: str, code: Code | None = None) -> None:
        """Say that what was moving ended: the arm is put elsewhere."""
        self._end_stream(why, code)
        self._end_motion(why, code)

    def put(self, mode: ResetMode | None) -> None:
        """Be in a robot mode; None: in the present one, at rest. The arm was put somewhere at rest before."""
        if mode is not None:
            self.activity = _PUT[mode]
            self.safety.clear()
        elif self.activity.protective:
            self.activity = Activity.PROTECTIVE_STOP
        elif self.activity is Activity.BRAKING or (self.safety.emergencies and self.activity.moving):
            self.activity = Activity.POWER_OFF
        elif self.activity.moving:
            self.activity = Activity.REST
        self._overload.forget()

    def watch(self, now: float) -> None:
        """End a stream that nobody keeps up."""
        silence = self._streaming.silence(now)
        if silence is not None:
            self.interrupt(silence)

    def step(self) -> Sample:
        """One tick of the line.

        Raises:
            PlantError: The arm's state is no longer finite: `recover`.
        """
        sample = self.cycle.step()
        stream = self._streaming.stream
        refused = stream is not None and self.cycle.trajectory is not stream
        if refused or (self.cycle.stopping and self.activity is Activity.ENDING):
            self.end("interruption", str(self.ahead.met), "collision")
        if self.cycle.at_rest and self.activity.moving:
            self._arrive()
        if self.activity.robot_mode is RobotMode.RUNNING:
            self._watch_torque(sample)
        return sample

    def _arrive(self) -> None:
        """The shaped reference rests."""
        target = after(self.activity, "at_rest")
        if target is not None:
            self.activity = target
            if self._move is not None:
                self._emit("motion_done", id=self._move.number)
                self._move = None

    def _watch_torque(self, sample: Sample) -> None:
        """Protect drives that give more than they should for longer than they may."""
        joint = self._overload.joint(sample.measured.moment)
        if joint is not None:
            name, limit = self.cycle.description.robot.joints[joint], self._overload.limits[joint]
            moment = sample.measured.moment[joint]
            why = f"torque of joint {name} is {moment:.0f} N m; beyond its {limit:g} for more than 10 ms"
            self.protect(why, "limit_torque")

    def _end_motion(self, why: str, code: Code | None, **told: Unpack[Told]) -> None:
        if self._move is not None:
            self._emit("motion_stopped", id=self._move.number, code=code, why=why, **told)
            self._move = None

    def _end_stream(self, why: str, code: Code | None = None, **told: Unpack[Told]) -> None:
        if self._streaming.end():
            self._emit("stream_stopped", code=code, why=why, **told)

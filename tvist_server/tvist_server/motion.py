"""What the robot is doing: motions by their numbers, streams of set-points, stops, power and protective stops.

`tvist_protocol.transitions` says what leads where; here it is done.
"""

from dataclasses import replace
from typing import Protocol, TypedDict

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.plant import PERIOD, PlantError
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind
from tvist_protocol.transitions import Activity, after
from tvist_protocol.values import ResetMode
from tvist_server.brakes import brake
from tvist_server.collision import CLEARANCE, CollisionModel
from tvist_server.control.differentiator import Floats
from tvist_server.cycle import STILL, ControlCycle, Sample
from tvist_server.outlook import Outlook
from tvist_server.overload import Overload
from tvist_server.refusal import RefusalError, out_of_turn
from tvist_server.safety import REDUCED_SHARE, acceleration_on_way, largest_torque, torque_to_come
from tvist_server.safety_system import SafetySystem
from tvist_server.stops import StopPlan
from tvist_server.trajectory import DoubleS, Limits, SetpointStream
from tvist_server.way_ahead import WayAhead
from tvist_shaping.base import Filter

STREAM_TIMEOUT = 0.25
"""A stream without set-points for this long is stopped [s]."""
LOOKS = 64
"""Moments of a motion at which its torque is looked at before it is run ahead."""
BLUNTED = 1.05
"""By how much the shaped motion's torque may be beyond that of the unshaped one, which it lags behind [-]."""
PAUSE_SHARE = 0.95
"""Share of the acceleration that torque leaves on the way that a pause uses: the filter may add a little [-]."""
LEAST_PAUSE = 0.2
"""Where torque leaves less than this share of a motion's acceleration to a pause, the motion goes on to its end [-]."""


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


class Emit(Protocol):
    """Puts down an event."""

    def __call__(
        self,
        kind: EventKind,
        *,
        id: int | None = None,  # noqa: A002  the wire's name
        code: Code | None = None,
        why: str | None = None,
        category: int | None = None,
        duration: float | None = None,
        way: float | None = None,
    ) -> None:
        """Of the tick that is being made, or of the next one between two."""


class Told(TypedDict):
    """What the event of a stop says of it."""

    category: int | None
    duration: float | None
    way: float | None


NO_STOP = Told(category=None, duration=None, way=None)
"""Of an end that is no stop."""


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
        self._ahead = WayAhead(cycle, self.outlook, collisions)
        limits = cycle.description.limits
        self._overload = Overload(limits.torque)
        self._reduced_velocity = REDUCED_SHARE * min(limits.velocity)
        self._started = 0
        self._motion: int | None = None
        self._trajectory: DoubleS | None = None
        self._velocity = 0.0
        """Limit of the running motion [rad/s]."""
        self._speed = 1.0
        self._held = False
        """Whether the running motion is held by a pause."""
        self._stream: SetpointStream | None = None
        self._heard = 0.0
        self._late, self._lost, self._limited = 0, 0, 0

    @property
    def streaming(self) -> bool:
        """Whether a stream of set-points is followed."""
        return self._stream is not None

    @property
    def sequence(self) -> int | None:
        """Newest set-point taken in; None without a stream, or before its first."""
        return None if self._stream is None else self._stream.sequence

    def counters(self) -> tuple[int, int, int]:
        """Late, lost and limited set-points since the start, the running stream's included."""
        stream = self._stream
        late, lost, limited = (stream.late, stream.lost, stream.limited) if stream else (0, 0, 0)
        return self._late + late, self._lost + lost, self._limited + limited

    def move(self, target: Floats, limits: Limits) -> int:
        """Start a point-to-point motion; its number.

        Raises:
            RefusalError: The arm is busy, there is no such motion, or something would meet on its way.
        """
        self._check("move_j")
        start = self.cycle.reference
        try:
            spared = replace(limits, acceleration=limits.acceleration * (1.0 - self.cycle.tvist.excess))
            trajectory = self.cycle.plan(target, spared, self._rate(limits.velocity))
        except ValueError as error:
            raise RefusalError("out_of_range", "velocity", str(error)) from error
        found = self.collisions.on_line(start, target)
        if found is not None:
            share, meeting = found
            after = trajectory.time_at(share)
            raise RefusalError("collision", "q", f"{meeting} {after:.2f} s after the start", CLEARANCE)
        self.cycle.tvist.aim(target)
        self.cycle.start(trajectory)
        self._started += 1
        self._motion, self._trajectory, self._velocity = self._started, trajectory, limits.velocity
        self._held = False
        self._go("move_j")
        self._emit("motion_started", id=self._motion)
        self._warn_of_torque(start, target, spared)
        return self._motion

    def _warn_of_torque(self, start: Floats, target: Floats, limits: Limits) -> None:
        """Say by how much a motion that has just begun will pass a limit of torque, where it will."""
        cycle, allowed = self.cycle, self._overload.limits
        most = largest_torque(
            cycle.inverse_dynamics, start, target - start, limits.velocity, limits.acceleration
        )
        if (most <= allowed).all() or (self._torque_before_shaping() * BLUNTED <= allowed).all():
            return
        ahead = self.outlook.foresee()
        if ahead is None:
            return
        most = torque_to_come(cycle.inverse_dynamics, ahead, PERIOD)[0]
        joint = int(np.argmax(most / allowed))
        if most[joint] > allowed[joint]:
            name, limit = cycle.description.robot.joints[joint], allowed[joint]
            why = (
                f"torque of joint {name} will reach {most[joint]:.0f} N m, "
                f"{most[joint] - limit:.1f} beyond its limit of {limit:g}: ask for less acceleration"
            )
            self._emit("warning", id=self._motion, code="limit_torque", why=why)

    def _torque_before_shaping(self) -> Floats:
        """Largest torques of the motion that has just begun as it would be without a filter, shape (n,) [N m]."""
        assert self._trajectory is not None, "a motion has begun"
        dynamics, states = self.cycle.inverse_dynamics, self._trajectory.states(LOOKS)
        most: Floats = np.max([dynamics.effort(*state) for state in states], axis=0)
        return most

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
        self._hold()

    def _hold(self) -> None:
        """Slow the motion down to a standstill within the torque, where that ends it sooner."""
        trajectory, cycle = self._trajectory, self.cycle
        if trajectory is None or self._held:
            return
        most = trajectory.limits.acceleration
        speed = max(trajectory.velocity, float(np.abs(cycle.newest.qd).max()))
        left = trajectory.target - cycle.position
        farthest = float(np.abs(left).max())
        way = left * min(speed * speed / (most * max(farthest, STILL)), 1.0)
        room = acceleration_on_way(cycle.inverse_dynamics, cycle.position, way, speed, self._overload.limits)
        room *= PAUSE_SHARE
        self._held = room > LEAST_PAUSE * most and trajectory.hold(min(room, most))

    def resume(self) -> None:
        """Go on with a motion that was paused.

        Raises:
            RefusalError: None is.
        """
        self._go("resume")
        if self._trajectory is not None and self._held:
            self._trajectory.release(self._rate(self._velocity))
        self._held = False

    @property
    def speed(self) -> float:
        """Rate of the running motion's time; without one, that of the next [-]."""
        return self._speed if self._trajectory is None else self._trajectory.rate

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
        if self._trajectory is not None and not self._held:
            self._trajectory.speed = self._rate(self._velocity)

    def reduce(self, *, reduced: bool) -> None:
        """Slow motions down on their way, or let them go on; a stream, whose time is its client's, is stopped."""
        self.safety.reduced = reduced
        self._set_rate()
        if reduced and self._stream is not None and self._stream.limits.velocity > self._reduced_velocity:
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
        target = after(self.activity, "brakes")
        if target is None:
            self._emit("safety_stop", why=why, category=0, duration=0.0, way=0.0)
            return
        self.activity = target
        cycle, plan = self.cycle, StopPlan(None, None, limited=False, duration=0.0, way=0.0)
        if not cycle.at_rest:
            stop = brake(cycle.description, cycle.arm.payload, cycle.newest, PERIOD)
            way = float(np.abs(stop.end - cycle.position).max())
            plan = replace(plan, duration=stop.duration, way=way)
            self.outlook.brake(stop)
        self._tell_end(plan, why, None, "safety_stop", 0)

    def until_rest(self) -> tuple[float | None, float | None]:
        """How long it takes until the shaped reference rests [s], and how far it goes [rad]; see `WayAhead`."""
        return self._ahead.until_rest()

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
        self._stream = self.cycle.stream(period, limits)
        self._ahead.begin()
        self._heard = now

    def offer(self, sequence: int, q: Floats, now: float) -> None:
        """Take a set-point of the running stream."""
        if self._stream is not None:
            self._heard = now
            self._stream.offer(sequence, q)

    def end_stream(self) -> None:
        """Bring the stream to rest through the filter.

        Raises:
            RefusalError: None is running.
        """
        if self._stream is None:
            raise out_of_turn("servo_stop", self.activity)
        end = self.cycle.end_of(self._stream)
        met = self._ahead.after_stream(end)
        if met is not None:
            self.interrupt(f"{met} before the stream came to rest through the filter", "collision")
            return
        self._go("servo_stop")
        self.cycle.start(end)
        self._forget_stream("servo_stop")

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
        plan = None if self.cycle.at_rest else self._ahead.stop(deceleration)
        if plan is not None and plan.limited:
            kept = "the motion's own" if plan.acceleration is None else f"{plan.acceleration:.3g} rad/s²"
            why = f"{why}; deceleration is {kept}, limited from {deceleration:.3g}"
        bare = self._motion is None  # what has no number ends without a word on limits
        self._tell_end(plan, why, code, kind, category)
        if bare and plan is not None and plan.limited:
            self._emit("warning", code="limit_acceleration", why=why)

    def _tell_end(
        self, plan: StopPlan | None, why: str, code: Code | None, kind: EventKind | None, category: int
    ) -> None:
        """Tell of a stop, and of what it has ended."""
        duration, way = (0.0, 0.0) if self.cycle.at_rest else self._ahead.until_rest(plan)
        told = Told(category=category, duration=duration, way=way)
        if kind is not None:
            self._emit(kind, code=code, why=why, **told)
        if self._stream is not None:
            self._forget_stream(why, code, told)
        if self._motion is not None:
            self._end_motion(why, code, told)

    def abandon(self, why: str, code: Code | None = None) -> None:
        """Say that what was moving ended: the arm is put elsewhere."""
        self._forget_stream(why, code)
        if self._motion is not None:
            self._end_motion(why, code)

    def put(self, mode: ResetMode | None) -> None:
        """Be in a robot mode; None: in the present one, at rest. The arm was put somewhere at rest before."""
        if mode is not None:
            self.activity = _PUT[mode]
            self.safety.clear()
        elif self.activity.protective:
            self.activity = Activity.PROTECTIVE_STOP
        elif self.activity is Activity.BRAKING or (self.safety.emergency and self.activity.moving):
            self.activity = Activity.POWER_OFF
        elif self.activity.moving:
            self.activity = Activity.REST
        self._overload.forget()

    def watch(self, now: float) -> None:
        """End a stream that nobody keeps up."""
        if self._stream is not None and now - self._heard >= STREAM_TIMEOUT:
            self.interrupt(f"no set-point for {STREAM_TIMEOUT:g} s")

    def step(self) -> Sample:
        """One tick of the line.

        Raises:
            PlantError: The arm's state is no longer finite: `recover`.
        """
        sample = self.cycle.step()
        if self.cycle.stopping and self.activity in {Activity.STREAMING, Activity.ENDING}:
            self.end("interruption", str(self._ahead.met), "collision")
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
            if self._motion is not None:
                self._emit("motion_done", id=self._motion)
                self._forget_motion()

    def _watch_torque(self, sample: Sample) -> None:
        """Protect drives that give more than they should for longer than they may."""
        joint = self._overload.joint(sample.measured.moment)
        if joint is not None:
            name, limit = self.cycle.description.robot.joints[joint], self._overload.limits[joint]
            moment = sample.measured.moment[joint]
            why = f"torque of joint {name} is {moment:.0f} N m; beyond its {limit:g} for more than 10 ms"
            self.protect(why, "limit_torque")

    def check_payload(self, payload: Payload, tvist: Filter | None) -> None:
        """Check the rest of what moves with another payload, and put it into the collision model.

        Args:
            payload: What the controller is to believe that the arm carries.
            tvist: Filter that comes with it; None for the present one.

        Raises:
            RefusalError: Something would meet; nothing has changed.
        """
        before, q = self.collisions.carried, self.cycle.position
        escaping = self.cycle.at_rest or self.collisions.meeting(q) is not None
        self.collisions.carry(payload)
        met = None if escaping else self.collisions.meeting(q)
        met = met or self._ahead.rest_of_way(tvist)
        if met is not None:
            self.collisions.carry(before)
            why = f"{met} on the rest of the way with this payload"
            raise RefusalError("collision", "com", why, CLEARANCE)

    def check_filter(self, tvist: Filter) -> None:
        """Check the rest of a stream that has ended with another filter.

        Raises:
            RefusalError: Something would meet.
        """
        if self.activity is Activity.ENDING:
            met = self._ahead.rest_of_way(tvist)
            if met is not None:
                raise RefusalError("collision", "name", f"{met} on the rest of the way", CLEARANCE)

    def _end_motion(self, why: str, code: Code | None, told: Told = NO_STOP) -> None:
        self._emit("motion_stopped", id=self._motion, code=code, why=why, **told)
        self._forget_motion()

    def _forget_motion(self) -> None:
        self._motion, self._trajectory, self._held = None, None, False

    def _forget_stream(self, why: str, code: Code | None = None, told: Told = NO_STOP) -> None:
        if self._stream is not None:
            self._late, self._lost, self._limited = self.counters()
            self._stream = None
            self._emit("stream_stopped", code=code, why=why, **told)

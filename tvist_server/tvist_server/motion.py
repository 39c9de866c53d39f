"""What the robot is doing: motions by their numbers, streams of set-points, stops, power and protective stops.

`tvist_protocol.transitions` says what leads where; here it is done.
"""

from dataclasses import replace
from typing import Protocol

import numpy as np

from tvist_plant.plant import PlantError
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind
from tvist_protocol.transitions import Activity, after
from tvist_protocol.values import ResetMode
from tvist_server.collision import CLEARANCE, CollisionModel, Meeting
from tvist_server.control.differentiator import Floats
from tvist_server.cycle import ControlCycle, Sample
from tvist_server.overload import Overload
from tvist_server.refusal import RefusalError, out_of_turn
from tvist_server.safety import GENTLEST_STOP, REDUCED_SHARE
from tvist_server.trajectory import DoubleS, Limits, SetpointStream

STREAM_TIMEOUT = 0.25
"""A stream without set-points for this long is stopped [s]."""
LOOKS = np.linspace(0.0, 1.0, 9)[1:, None]
"""Shares of the way to rest at which a stream is looked ahead of [-], shape (8, 1)."""


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
    ) -> None:
        """Of the tick that is being made, or of the next one between two."""


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
        self._emit = emit
        limits = cycle.description.limits
        self._overload = Overload(limits.torque)
        self._reduced = False
        self._reduced_velocity = REDUCED_SHARE * min(limits.velocity)
        self._started = 0
        self._motion: int | None = None
        self._trajectory: DoubleS | None = None
        self._velocity = 0.0
        """Limit of the running motion [rad/s]."""
        self._speed = 1.0
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
        way = target - start
        found = self.collisions.on_way(lambda share: start + share * way, float(np.abs(way).sum()))
        if found is not None:
            share, meeting = found
            after = trajectory.time_at(share)
            raise RefusalError("collision", "q", f"{_met(meeting)} {after:.2f} s after the start", CLEARANCE)
        self.cycle.tvist.aim(target)
        self.cycle.start(trajectory)
        self._started += 1
        self._motion, self._trajectory, self._velocity = self._started, trajectory, limits.velocity
        self._go("move_j")
        self._emit("motion_started", id=self._motion)
        return self._motion

    def set_speed(self, fraction: float) -> None:
        """Scale the time of motions, the one that runs and those to come; streams keep their client's time."""
        self._speed = fraction
        self._set_rate()

    def pause(self) -> None:
        """Bring the motion to a standstill on its way.

        Raises:
            RefusalError: None is running.
        """
        self._go("pause")
        self._set_rate()

    def resume(self) -> None:
        """Go on with a motion that was paused.

        Raises:
            RefusalError: None is.
        """
        self._go("resume")
        self._set_rate()

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
        return RuntimeState.PAUSING if state is RuntimeState.PAUSED and self.speed > 0.0 else state

    @property
    def safety_mode(self) -> SafetyMode:
        """What the safety system allows."""
        return self.activity.safety_mode(reduced=self._reduced)

    def _rate(self, velocity: float) -> float:
        """Rate for the time of a motion with this velocity limit [-]."""
        return min(self._speed, self._reduced_velocity / velocity) if self._reduced else self._speed

    def _set_rate(self) -> None:
        if self._trajectory is not None:
            paused = self.activity is Activity.PAUSED
            self._trajectory.speed = 0.0 if paused else self._rate(self._velocity)

    def reduce(self, *, reduced: bool) -> None:
        """Reduce the speed, or allow all of it again.

        Motions are slowed on their way; a stream, whose time is its client's, is stopped if it may be faster.
        """
        if reduced == self._reduced:
            return
        self._reduced = reduced
        share = f"{100 * REDUCED_SHARE:g} % of the joints' limits" if reduced else "no longer reduced"
        self._emit("warning", why=f"safety_mode is {self.safety_mode.name}: speed is {share}")
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

    def power_off(self) -> None:
        """Stop what moves, then take the power; the brakes hold the arm where it is."""
        self._end("power_off", "power_off was commanded")

    def protect(self, why: str, code: Code | None = None) -> None:
        """Make a protective stop; nothing happens where the brakes hold the arm or power is on its way out."""
        if after(self.activity, "protective_stop") is not None:
            self._emit("protective_stop", code=code, why=why)
            self._end("protective_stop", why, code)

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
        return target

    def _go(self, trigger: str) -> None:
        self.activity = self._check(trigger)

    def follow(self, period: float, limits: Limits, now: float) -> None:
        """Start to follow set-points.

        Raises:
            RefusalError: The arm is busy, or such a stream may be too fast.
        """
        target = self._check("servo_start")
        if self._reduced and limits.velocity > (most := self._reduced_velocity):
            why = f"velocity is {limits.velocity:g} rad/s; safety_mode is REDUCED, which leaves {most:.3g}"
            raise RefusalError("limit_velocity", "velocity", why, most)
        self.activity = target
        self._stream = self.cycle.stream(period, limits)
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
        self._go("servo_stop")
        if self._stream is not None:
            self.cycle.end_stream(self._stream)
        self._forget_stream("servo_stop")

    def stop(self, deceleration: float | None, why: str, code: Code | None = None) -> None:
        """Stop past the filter, and say how what was moving ended.

        Args:
            deceleration: Wanted limit [rad/s^2]; None for what the torque allows.
            why: The reason, for a person.
            code: The reason, for a program.
        """
        self._end("stop", why, code, deceleration)

    def interrupt(self, why: str, code: Code | None = None) -> None:
        """End motion that may not go on, as `stop` does."""
        self._end("interruption", why, code)

    def _end(
        self, trigger: str, why: str, code: Code | None = None, deceleration: float | None = None
    ) -> None:
        """Go where a trigger leads, and stop on the way what moves. One that leads nowhere is none of ours."""
        target = after(self.activity, trigger)
        if target is None:
            return
        self.activity = target
        self._forget_stream(why, code)
        plan = None if self.cycle.at_rest else self.cycle.stop(deceleration)
        if plan is not None and plan.limited:
            why = f"{why}; deceleration is {plan.acceleration:.3g} rad/s², limited from {deceleration:.3g}"
            if self._motion is None:
                self._emit("warning", code="limit_acceleration", why=why)
        if self._motion is not None:
            self._end_motion(why, code)

    def abandon(self, why: str, code: Code | None = None) -> None:
        """Say that what was moving ended: the arm is put elsewhere."""
        self._forget_stream(why, code)
        if self._motion is not None:
            self._end_motion(why, code)

    def put(self, mode: ResetMode | None) -> None:
        """Be in a robot mode; None: in the present one, at rest. The arm was put somewhere at rest before."""
        if mode is not None:
            self.activity = _PUT[mode]
        elif self.activity.safety_mode(reduced=False) is SafetyMode.PROTECTIVE_STOP:
            self.activity = Activity.PROTECTIVE_STOP
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
        if self._stream is not None:
            self._look_ahead()
        sample = self.cycle.step()
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

    def _look_ahead(self) -> None:
        """Stop a stream before it brings the arm to where something meets.

        Far from everything a rough guess of where a stop would end is enough; near something the stop itself is
        planned, with what the torque allows there.
        """
        state = self.cycle.newest
        ahead = state.q + LOOKS * (state.qd * np.abs(state.qd) / (2.0 * GENTLEST_STOP))
        if all(self.collisions.meeting(q) is None for q in ahead):
            return
        stop = self.cycle.plan_stop(None).trajectory
        for share in LOOKS[:, 0]:
            meeting = self.collisions.meeting(stop.at(share * stop.duration)[0])
            if meeting is not None:
                self.interrupt(_met(meeting), "collision")
                return

    def _end_motion(self, why: str, code: Code | None = None) -> None:
        self._emit("motion_stopped", id=self._motion, code=code, why=why)
        self._forget_motion()

    def _forget_motion(self) -> None:
        self._motion, self._trajectory = None, None

    def _forget_stream(self, why: str, code: Code | None = None) -> None:
        if self._stream is not None:
            self._late, self._lost, self._limited = self.counters()
            self._stream = None
            self._emit("stream_stopped", code=code, why=why)


def _met(meeting: Meeting) -> str:
    return f"{meeting.first} and {meeting.second} would be {1e3 * meeting.distance:.0f} mm apart"

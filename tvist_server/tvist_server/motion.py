"""What moves and how it ends: point-to-point motions by their numbers, streams of set-points, stops."""

from typing import Protocol

import numpy as np

from tvist_protocol.modes import RuntimeState
from tvist_protocol.replies import Code
from tvist_protocol.stream import EventKind
from tvist_server.collision import CLEARANCE, CollisionModel, Meeting
from tvist_server.control.differentiator import Floats
from tvist_server.cycle import ControlCycle, Sample
from tvist_server.refusal import RefusalError
from tvist_server.safety import GENTLEST_STOP
from tvist_server.trajectory import DoubleS, Limits, SetpointStream

STREAM_TIMEOUT = 0.25
"""A stream without set-points for this long is stopped [s]."""
LOOKS = np.linspace(0.0, 1.0, 9)[1:, None]
"""Shares of the way to rest at which a stream is looked ahead of [-], shape (8, 1)."""


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
    """

    def __init__(self, cycle: ControlCycle, collisions: CollisionModel, emit: Emit) -> None:
        self.cycle = cycle
        self.collisions = collisions
        self._emit = emit
        self._started = 0
        self._motion: int | None = None
        self._trajectory: DoubleS | None = None
        self._speed, self._paused = 1.0, False
        self._stream: SetpointStream | None = None
        self._heard = 0.0
        self._late, self._lost, self._limited = 0, 0, 0

    @property
    def streaming(self) -> bool:
        """Whether a stream of set-points is followed."""
        return self._stream is not None

    @property
    def sequence(self) -> int | None:
        """Newest set-point that reached the reference; None without a stream, or before its first."""
        return None if self._stream is None else self._stream.sequence

    def counters(self) -> tuple[int, int, int]:
        """Late, lost and limited set-points since the start, the running stream's included."""
        stream = self._stream
        late, lost, limited = (stream.late, stream.lost, stream.limited) if stream else (0, 0, 0)
        return self._late + late, self._lost + lost, self._limited + limited

    def check_rest(self) -> None:
        """Refuse while something moves.

        Raises:
            RefusalError: The arm is busy.
        """
        if not self.cycle.at_rest or self._stream is not None:
            raise RefusalError("busy", "", "the arm is moving: wait for motion_done or send stop")

    def move(self, target: Floats, limits: Limits) -> int:
        """Start a point-to-point motion; its number.

        Raises:
            RefusalError: The arm is busy, there is no such motion, or something would meet on its way.
        """
        self.check_rest()
        start = self.cycle.reference
        try:
            trajectory = self.cycle.plan(target, limits, self._speed)
        except ValueError as error:
            raise RefusalError("out_of_range", "velocity", str(error)) from error
        way = target - start
        found = self.collisions.on_way(lambda share: start + share * way, float(np.abs(way).sum()))
        if found is not None:
            share, meeting = found
            after = trajectory.time_at(share)
            raise RefusalError("collision", "q", f"{_met(meeting)} {after:.2f} s after the start", CLEARANCE)
        self.cycle.start(trajectory)
        self._started += 1
        self._motion, self._trajectory, self._paused = self._started, trajectory, False
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
        if self._motion is None:
            raise RefusalError("wrong_mode", "type", "no motion is running: there is nothing to pause")
        self._paused = True
        self._set_rate()

    def resume(self) -> None:
        """Go on with a motion that was paused.

        Raises:
            RefusalError: None is.
        """
        if self._motion is None or not self._paused:
            raise RefusalError("wrong_mode", "type", "no motion is paused: there is nothing to resume")
        self._paused = False
        self._set_rate()

    @property
    def speed(self) -> float:
        """Rate of the running motion's time; without one, that of the next [-]."""
        return self._speed if self._motion is None or self._trajectory is None else self._trajectory.rate

    @property
    def runtime(self) -> RuntimeState:
        """Whether something moves."""
        if self.cycle.at_rest:
            return RuntimeState.STOPPED
        if self._motion is not None and self._paused:
            return RuntimeState.PAUSED if self.speed == 0.0 else RuntimeState.PAUSING
        return RuntimeState.PLAYING

    def _set_rate(self) -> None:
        if self._trajectory is not None:
            self._trajectory.speed = 0.0 if self._paused else self._speed

    def follow(self, period: float, limits: Limits, now: float) -> None:
        """Start to follow set-points.

        Raises:
            RefusalError: The arm is busy.
        """
        self.check_rest()
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
        if self._stream is None:
            raise RefusalError("wrong_mode", "", "no stream is running: send servo_start first")
        self.cycle.end_stream(self._stream)
        self._forget_stream("servo_stop")

    def stop(self, deceleration: float | None, why: str, code: Code | None = None) -> None:
        """Stop past the filter, and say how what was moving ended.

        Args:
            deceleration: Wanted limit [rad/s^2]; None for what the torque allows.
            why: The reason, for a person.
            code: The reason, for a program.
        """
        self._forget_stream(why, code)
        plan = None if self.cycle.at_rest else self.cycle.stop(deceleration)
        if plan is None:
            return
        if plan.limited:
            why = f"{why}; deceleration is {plan.acceleration:.3g} rad/s², limited from {deceleration:.3g}"
        if self._motion is not None:
            self._end_motion(why, code)
        elif plan.limited:
            self._emit("warning", code="limit_acceleration", why=why)

    def abandon(self, why: str) -> None:
        """Say that what was moving ended: the arm is put elsewhere."""
        self._forget_stream(why)
        if self._motion is not None:
            self._end_motion(why)

    def watch(self, now: float) -> None:
        """End a stream that nobody keeps up."""
        if self._stream is not None and now - self._heard >= STREAM_TIMEOUT:
            self.stop(None, f"no set-point for {STREAM_TIMEOUT:g} s")

    def step(self) -> Sample:
        """One tick of the line."""
        if self._stream is not None:
            self._look_ahead()
        sample = self.cycle.step()
        if self.cycle.at_rest and self._motion is not None:
            self._emit("motion_done", id=self._motion)
            self._forget_motion()
        return sample

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
                self.stop(None, _met(meeting), "collision")
                return

    def _end_motion(self, why: str, code: Code | None = None) -> None:
        self._emit("motion_stopped", id=self._motion, code=code, why=why)
        self._forget_motion()

    def _forget_motion(self) -> None:
        self._motion, self._trajectory, self._paused = None, None, False

    def _forget_stream(self, why: str, code: Code | None = None) -> None:
        if self._stream is not None:
            self._late, self._lost, self._limited = self.counters()
            self._stream = None
            self._emit("stream_stopped", code=code, why=why)


def _met(meeting: Meeting) -> str:
    return f"{meeting.first} and {meeting.second} would be {1e3 * meeting.distance:.0f} mm apart"

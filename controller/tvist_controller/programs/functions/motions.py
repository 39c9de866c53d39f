"""Functions that move the arm."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from tvist_controller.commands.refusal import SLOWEST, RefusalError, check_joints
from tvist_controller.line.differentiator import STILL, Floats
from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import integer, is_pose, number, numbers, pose, positive, shown
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import Turns
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.programs.led_moves import TURN, LedMoves, approach
from tvist_controller.trajectory import Guided, Speed
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment, Segment
from tvist_protocol.transitions import Activity
from tvist_urscript import Array, Fault, costs

MAX_BLEND: Final = 10.0
LONGEST: Final = 3600.0
"""Longest duration of a move [s]."""
CLOSE: Final = 1e-3
"""Distance at which `servoc` has arrived [m, and rad times `TURN`]."""


class MotionFunctions:
    """Moves the arm of one robot.

    Args:
        access: The robot.
        arm: Its arm.
        kinematics: Its kinematics.
    """

    def __init__(self, access: Access, arm: ProgramArm, kinematics: ProgramKinematics) -> None:
        self._access, self._arm, self._kinematics = access, arm, kinematics
        self._led = LedMoves(access, arm, kinematics)
        arm.lead = self._led.follow
        limits = access.description.limits
        self._velocity, self._acceleration = min(limits.velocity), min(limits.acceleration)

    # ------------------------------------------------------------------ planned moves

    @costs(180)
    def movej(self, q: object, a: object = 1.4, v: object = 1.05, t: object = 0, r: object = 0) -> Turns:
        """Move all joints in phase to joint positions, or to those nearest that reach a pose."""
        posture, speed = self._posture("q", q), positive("v", v)
        if speed > self._velocity and number("t", t) == 0.0:
            why = f"v of movej is {speed:.4g} rad/s: the joints turn with at most {self._velocity:.4g}"
            self._access.emit("warning", code="limit_velocity", why=why)
        segment = JointSegment(
            q=posture,
            velocity=self._within(speed, "velocity", self._velocity),
            acceleration=self._within(positive("a", a), "acceleration", self._acceleration),
            duration=_duration(t),
            blend=number("r", r, 0.0, MAX_BLEND),
        )
        yield from self._follow(segment)

    @costs(60)
    def movel(self, pose: object, a: object = 1.2, v: object = 0.25, t: object = 0, r: object = 0) -> Turns:
        """Move the tool on a straight line to a pose, or to the one at joint positions."""
        segment = LineSegment(
            pose=self._pose("pose", pose),
            velocity=_tool("v", v, "velocity"),
            acceleration=_tool("a", a, "acceleration"),
            duration=_duration(t),
            blend=number("r", r, 0.0, MAX_BLEND),
        )
        yield from self._follow(segment)

    @costs(60)
    def movep(self, pose: object, a: object = 1.2, v: object = 0.25, r: object = 0) -> Turns:
        """Move the tool on a straight line at a constant speed, also in the blend at its end."""
        segment = ProcessSegment(
            pose=self._pose("pose", pose),
            velocity=_tool("v", v, "velocity"),
            acceleration=_tool("a", a, "acceleration"),
            blend=number("r", r, 0.0, MAX_BLEND),
        )
        yield from self._follow(segment)

    @costs(100)
    def movec(
        self,
        pose_via: object,
        pose_to: object,
        a: object = 1.2,
        v: object = 0.25,
        r: object = 0,
        mode: object = 0,
    ) -> Turns:
        """Move the tool on an arc through the position of one pose to another."""
        segment = ArcSegment(
            via=self._pose("pose_via", pose_via),
            pose=self._pose("pose_to", pose_to),
            orientation="tangent" if integer("mode", mode, 0, 1) else "interpolated",
            velocity=_tool("v", v, "velocity"),
            acceleration=_tool("a", a, "acceleration"),
            blend=number("r", r, 0.0, MAX_BLEND),
        )
        yield from self._follow(segment)

    @costs(180)
    def optimovej(self, goal: object, a: object = 0.3, v: object = 0.3, r: object = 0) -> Turns:
        """Move the joints with shares of the arm's largest acceleration and velocity."""
        acceleration, velocity = _share("a", a), _share("v", v)
        yield from self.movej(goal, acceleration * self._acceleration, velocity * self._velocity, 0, r)

    @costs(60)
    def optimovel(self, goal: object, a: object = 0.3, v: object = 0.3, r: object = 0) -> Turns:
        """Move the tool on a line with shares of the largest acceleration and speed, which the joints limit further."""
        acceleration, velocity = _share("a", a), _share("v", v)
        yield from self.movel(goal, acceleration * MAX_TOOL[1], velocity * MAX_TOOL[0], 0, r)

    def _follow(self, segment: Segment) -> Turns:
        if self._arm.lost:
            yield from self._arm.regain()
        moves = self._arm if self._access.force.compliant is None else self._led
        yield from moves.follow(segment)

    # ------------------------------------------------------------------ guided motions

    @costs(120)
    def servoj(
        self,
        q: object,
        a: object = 0,
        v: object = 0,
        t: object = 0.002,
        lookahead_time: object = 0.1,
        gain: object = 300,
    ) -> Turns:
        """Follow joint positions for a time; `a` and `v` have no effect, as on UR's robots."""
        posture = np.array(self._posture("q", q))
        del a, v
        ticks = _ticks("t", t)
        lookahead, abruptness = positive("lookahead_time", lookahead_time), positive("gain", gain)

        def start(shaped: bool) -> int | None:
            rests = self._access.motion.activity is Activity.REST
            if rests and np.abs(posture - self._reference).max() <= STILL:
                return None  # clients repeat where the arm is: no motion of a tick for each
            return self._access.guidance.servo(posture, lookahead, abruptness, shaped=shaped)

        yield from self._arm.guide(start, lambda: iter([None] * max(ticks, 1)))

    @costs(200)
    def servoc(self, pose: object, a: object = 1.2, v: object = 0.25, r: object = 0) -> Turns:
        """Move the tool towards a pose at a speed; the next call may replace the pose in motion."""
        goal = self._pose("pose", pose)
        acceleration, velocity = _tool("a", a, "acceleration"), _tool("v", v, "velocity")
        radius = max(number("r", r, 0.0, MAX_BLEND), CLOSE)
        guidance = self._access.guidance
        angular = acceleration / TURN

        def course() -> tuple[Floats, float]:
            away = self._kinematics.difference(self._kinematics.tool_pose(self._reference), goal)
            far = max(float(np.linalg.norm(away[:3])), TURN * float(np.linalg.norm(away[3:])))
            return approach(away, far, velocity, acceleration), far

        def start(shaped: bool) -> int:
            return guidance.move_tool(course()[0], acceleration, angular, shaped=shaped)

        def wait() -> Turns:
            yield
            while course()[1] > radius:
                yield from self._arm.regain()
                self._arm.steer(start)
                yield

        yield from self._arm.guide(start, wait)

    @costs(100)
    def speedj(self, qd: object, a: object = 1.4, t: object = None) -> Turns:
        """Approach velocities of the joints, and keep them; return after a time, or when they are reached."""
        joints, most = self._access.description.joints, self._access.description.limits.velocity
        wanted = np.array(numbers("qd", qd, joints))
        wanted *= min(1.0, *(limit / max(abs(one), 1e-12) for one, limit in zip(wanted, most, strict=True)))
        acceleration = self._within(positive("a", a), "acceleration", self._acceleration)

        def start(shaped: bool) -> int:
            return self._access.guidance.move_joints(wanted, acceleration, shaped=shaped)

        yield from self._arm.guide(start, self._wait(t))

    @costs(120)
    def speedl(self, xd: object, a: object = 1.2, t: object = None, aRot: object = None) -> Turns:
        """Approach a velocity of the tool in the base frame, and keep it; see `speedj`."""
        twist = np.array(numbers("xd", xd, 6))
        acceleration = _tool("a", a, "acceleration")
        angular = acceleration if aRot is None else positive("aRot", aRot, 1e5)

        def start(shaped: bool) -> int:
            return self._access.guidance.move_tool(twist, acceleration, angular, shaped=shaped)

        yield from self._arm.guide(start, self._wait(t))

    @costs(150)
    def stopj(self, a: object = 2) -> Turns:
        """Stop with a deceleration of the joints."""
        deceleration = self._within(positive("a", a), "acceleration", self._acceleration)
        yield from self._arm.halt(lambda: self._access.guidance.stop_joints(deceleration))

    @costs(150)
    def stopl(self, a: object = 1.2, aRot: object = None) -> Turns:
        """Stop with a deceleration of the tool."""
        deceleration = _tool("a", a, "acceleration")
        angular = deceleration if aRot is None else positive("aRot", aRot, 1e5)
        yield from self._arm.halt(lambda: self._access.guidance.stop_tool(deceleration, angular))

    # ------------------------------------------------------------------ arguments

    @property
    def _reference(self) -> Floats:
        return self._access.guidance.reference

    @property
    def _here(self) -> list[float]:
        found: list[float] = self._reference.tolist()
        return found

    def _wait(self, t: object) -> Callable[[], Iterator[None]]:
        """How a call waits for a time, or if none is given until the velocity is reached."""
        if t is not None and (seconds := number("t", t, 0.0, LONGEST)) > 0.0:
            return lambda: self._arm.in_motion(seconds)

        def until_reached() -> Iterator[None]:
            yield
            while isinstance(speed := self._guided, Speed) and speed.duration > 0.0:
                yield

        return until_reached

    @property
    def _guided(self) -> Guided | None:
        return self._access.guidance.guided

    def _posture(self, name: str, value: object) -> tuple[float, ...]:
        """Joint positions within their range, from these or from a pose."""
        if is_pose(value):
            return self._kinematics.posture(pose(name, value), self._near)
        q = numbers(name, value, self._access.description.joints)
        try:
            check_joints(q, self._access.description, name)
        except RefusalError as refusal:
            raise Fault(refusal.reply.why) from refusal
        return q

    def _pose(self, name: str, value: object) -> tuple[float, float, float, float, float, float]:
        """A pose of the tool, from this or from joint positions."""
        if is_pose(value):
            return pose(name, value)
        if not isinstance(value, Array):
            raise Fault(f"{name} is {shown(value)}: it must be a pose or a list of joint positions")
        return self._kinematics.tool_pose(np.array(numbers(name, value, self._access.description.joints)))

    @property
    def _near(self) -> Sequence[float]:
        """Posture from which the next move begins."""
        end = self._arm.end
        if end is None:
            return self._here
        if isinstance(end, JointSegment):
            return end.q
        return self._kinematics.posture(end.pose, self._here)

    def _within(self, value: float, name: str, most: float) -> float:
        """A velocity or acceleration of the joints that the arm is capable of and that moves it."""
        return min(max(value, SLOWEST[name]), most)


MAX_TOOL: Final = 3.0, 15.0
"""Speed [m/s] and acceleration [m/s^2] of the tool that `optimovel` takes shares of."""


def _tool(name: str, value: object, kind: str) -> float:
    """A speed or acceleration of the tool, which the joints may limit further."""
    return max(positive(name, value, 1e3), SLOWEST[kind])


def _share(name: str, value: object) -> float:
    found = positive(name, value)
    if found > 1.0:
        raise Fault(f"{name} is {found:g}: it must be above 0 and at most 1")
    return found


def _duration(value: object) -> float | None:
    """Duration of a move, or None if its velocity and acceleration count [s]."""
    found = number("t", value, 0.0, LONGEST)
    return found if found > 0.0 else None


def _ticks(name: str, value: object) -> int:
    return round(number(name, value, 0.0, LONGEST) / PERIOD)

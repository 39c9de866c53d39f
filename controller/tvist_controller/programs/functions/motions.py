"""Functions that move the arm."""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Final

import numpy as np

from tvist_controller.line.differentiator import STILL, Floats
from tvist_controller.programs import arguments as args
from tvist_controller.programs.access import Access, refusals_as_faults
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.blended_moves import Turns
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.refusal import SLOWEST, check_joints
from tvist_controller.trajectory import VelocityFollower
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment, Segment
from tvist_protocol.transitions import Activity
from tvist_urscript import Array, Fault, Pose, costs

OUT_OF_REACH: Final = 10.0  # distance of a pose from the base that no arm reaches [m]
LONGEST: Final = 3600.0  # longest duration of a move [s]
ARRIVED = 1e-5  # distance at which a move without blend has arrived [m, and rad times `TURN`]
TURN = 0.25  # length equivalent to a turn by 1 rad [m]
SETTLING = 4.0  # ticks in which the remaining distance decays at the end
CLOSE: Final = 1e-3  # distance at which `servoc` has arrived [m, and rad times `TURN`]


MAX_TOOL: Final = 3.0, 15.0
"""Tool speed [m/s] and acceleration [m/s^2] that the fractions of `optimovel` refer to."""


def _share(name: str, value: object) -> float:
    found: float = args.above_zero()(name, value)
    if found > 1.0:
        raise Fault(f"{name} is {found:g}: it must be above 0 and at most 1")
    return found


PartOfLargest = Annotated[float, _share]
ToolRate = Annotated[float, args.above_zero(1e3)]
"""Speed or acceleration of the tool, possibly limited further by the joints."""
AngularRate = Annotated[float, args.above_zero(1e5)]
Duration = Annotated[float, args.within(0.0, LONGEST)]
"""Duration of a move; 0 to use velocity and acceleration [s]."""
Blend = Annotated[float, args.within(0.0, 10.0)]


class ForceModeMoves:
    """Moves steered by velocities: those of `servoc`, and all moves in force mode."""

    def __init__(self, access: Access, arm: ProgramArm, kinematics: ProgramKinematics) -> None:
        self._access, self._arm, self._kinematics = access, arm, kinematics

    def follow(self, segment: Segment) -> Turns:
        """Move along a part of a path in the stiff axes; with a blend, return at its radius."""
        if self._access.force.by_hand:
            raise Fault("in freedrive the arm follows no moves: call end_freedrive_mode before")
        if isinstance(segment, ArcSegment):
            raise Fault(
                "force mode allows lines and joint moves, no arcs: call end_force_mode before, or movel"
            )
        guidance, most = self._access.guidance, 2.0 * segment.acceleration
        duration = None if isinstance(segment, ProcessSegment) else segment.duration
        velocity = segment.velocity if duration is None else self._way(segment)[1] / duration
        yield from self.lead(segment, max(velocity, ARRIVED), most, max(segment.blend, ARRIVED))
        if segment.blend == 0.0:
            yield from self._arm.halt(lambda: guidance.stop_joints(guidance.limits.acceleration))

    def lead(self, segment: Segment, velocity: float, most: float, near: float) -> Turns:
        """Steer joints or tool to a move's end, until at most `near` away; the tool accelerates at `most`."""
        guidance, deceleration = self._access.guidance, segment.acceleration

        def start(shaped: bool) -> int:
            away, far = self._way(segment)
            speed = min(velocity, math.sqrt(2.0 * deceleration * far), far / (SETTLING * PERIOD))
            rates = away * (speed / far) if far > 0.0 else away
            if isinstance(segment, JointSegment):
                return guidance.move_joints(rates, guidance.limits.acceleration, shaped=shaped)
            return guidance.move_tool(rates, most, most / TURN, shaped=shaped)

        def wait() -> Turns:
            yield
            while self._way(segment)[1] > near:
                yield from self._arm.regain()
                self._arm.steer(start)
                yield

        return self._arm.guide(start, wait())

    def _way(self, segment: Segment) -> tuple[Floats, float]:
        """Return the remaining way of a move, in joint positions or of the tool, and its length."""
        here = self._access.guidance.reference
        if isinstance(segment, JointSegment):
            turn = np.array(segment.q) - here
            return turn, float(np.abs(turn).max())
        away = self._kinematics.difference(self._kinematics.tool_pose(here), segment.pose)
        return away, max(float(np.linalg.norm(away[:3])), TURN * float(np.linalg.norm(away[3:])))


class MotionFunctions(FunctionGroup):
    """Motions of one robot."""

    title = "Motions"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._led = ForceModeMoves(on.access, on.arm, on.kinematics)
        on.arm.lead = self._led.follow
        limits = on.access.description.limits
        self._velocity, self._acceleration = min(limits.velocity), min(limits.acceleration)

    # ------------------------------------------------------------------ planned moves

    @costs(180)
    def movej(
        self, q: object, a: args.Positive = 1.4, v: args.Positive = 1.05, t: Duration = 0, r: Blend = 0
    ) -> Turns:
        """Move all joints in phase to joint positions, or to the nearest ones for a pose."""
        posture = self._posture("q", q)
        if v > self._velocity and t == 0.0:
            why = f"v of movej is {v:.4g} rad/s: the joints turn with at most {self._velocity:.4g}"
            self._access.emit("warning", code="limit_velocity", why=why)
        return self._follow(
            JointSegment(
                q=posture,
                velocity=_within(v, "velocity", self._velocity),
                acceleration=_within(a, "acceleration", self._acceleration),
                duration=t or None,
                blend=r,
            )
        )

    @costs(60)
    def movel(
        self, pose: object, a: ToolRate = 1.2, v: ToolRate = 0.25, t: Duration = 0, r: Blend = 0
    ) -> Turns:
        """Move the tool on a straight line to a pose, or to the pose at joint positions.

        PolyScope's motions "until" something happens are moves to a pose 1 km away: towards such a pose the tool moves
        until it is stopped.
        """
        segment = LineSegment(
            pose=self._pose("pose", pose),
            velocity=_within(v, "velocity"),
            acceleration=_within(a, "acceleration"),
            duration=t or None,
            blend=r,
        )
        if float(np.linalg.norm(segment.pose[:3])) <= OUT_OF_REACH:
            return self._follow(segment)
        way = np.subtract(segment.pose[:3], self._kinematics.tool_pose(np.array(self._near))[:3])
        distance = float(np.linalg.norm(way))
        twist = (*(segment.velocity * way / distance), 0.0, 0.0, 0.0)
        return self.speedl(twist, segment.acceleration, distance / segment.velocity)

    @costs(60)
    def movep(self, pose: object, a: ToolRate = 1.2, v: ToolRate = 0.25, r: Blend = 0) -> Turns:
        """Move the tool on a straight line at constant speed, also in the blend at its end."""
        return self._follow(
            ProcessSegment(
                pose=self._pose("pose", pose),
                velocity=_within(v, "velocity"),
                acceleration=_within(a, "acceleration"),
                blend=r,
            )
        )

    @costs(100)
    def movec(
        self,
        pose_via: object,
        pose_to: object,
        a: ToolRate = 1.2,
        v: ToolRate = 0.25,
        r: Blend = 0,
        mode: args.Bit = 0,
    ) -> Turns:
        """Move the tool on an arc through the position of one pose to another pose."""
        return self._follow(
            ArcSegment(
                via=self._pose("pose_via", pose_via),
                pose=self._pose("pose_to", pose_to),
                orientation="tangent" if mode else "interpolated",
                velocity=_within(v, "velocity"),
                acceleration=_within(a, "acceleration"),
                blend=r,
            )
        )

    @costs(180)
    def optimovej(self, goal: object, a: PartOfLargest = 0.3, v: PartOfLargest = 0.3, r: Blend = 0) -> Turns:
        """Move the joints with fractions of the arm's largest acceleration and velocity."""
        return self.movej(goal, a * self._acceleration, v * self._velocity, 0, r)

    @costs(60)
    def optimovel(self, goal: object, a: PartOfLargest = 0.3, v: PartOfLargest = 0.3, r: Blend = 0) -> Turns:
        """Move the tool on a line with fractions of its largest acceleration and speed; joints may limit it."""
        return self.movel(goal, a * MAX_TOOL[1], v * MAX_TOOL[0], 0, r)

    def _follow(self, segment: Segment) -> Turns:
        if self._arm.compliance_lost:
            yield from self._arm.regain()
        moves = self._arm if self._access.guidance.compliant is None else self._led
        yield from moves.follow(segment)

    # ------------------------------------------------------------------ guided motions

    @costs(120)
    def servoj(
        self,
        q: object,
        a: object = 0,
        v: object = 0,
        t: Duration = 0.002,
        lookahead_time: args.Positive = 0.1,
        gain: args.Positive = 300,
    ) -> Turns:
        """Follow joint positions for a time; `a` and `v` have no effect, as on UR robots."""
        posture = np.array(self._posture("q", q))

        def start(shaped: bool) -> int | None:
            rests = self._access.motion.activity is Activity.REST
            if rests and np.abs(posture - self._reference).max() <= STILL:
                return None  # clients often repeat the present position: avoid motions of one tick
            return self._access.guidance.servo(posture, lookahead_time, gain, shaped=shaped)

        return self._arm.guide(start, iter([None] * max(round(t / PERIOD), 1)))

    @costs(200)
    def servoc(self, pose: object, a: ToolRate = 1.2, v: ToolRate = 0.25, r: Blend = 0) -> Turns:
        """Move the tool towards a pose at a speed; the next call may replace the pose in motion."""
        goal = ProcessSegment(
            pose=self._pose("pose", pose),
            velocity=_within(v, "velocity"),
            acceleration=_within(a, "acceleration"),
        )
        return self._led.lead(goal, goal.velocity, goal.acceleration, max(r, CLOSE))

    @costs(100)
    def speedj(self, qd: args.Joints, a: args.Positive = 1.4, t: Duration | None = None) -> Turns:
        """Approach joint velocities and keep them; return after a time, or when they are reached."""
        most, wanted = self._access.description.limits.velocity, np.array(qd)
        wanted *= min(1.0, *(limit / max(abs(one), 1e-12) for one, limit in zip(wanted, most, strict=True)))
        acceleration, guidance = _within(a, "acceleration", self._acceleration), self._access.guidance
        return self._arm.guide(
            lambda shaped: guidance.move_joints(wanted, acceleration, shaped=shaped), self._wait(t)
        )

    @costs(120)
    def speedl(
        self, xd: args.Vector6, a: ToolRate = 1.2, t: Duration | None = None, aRot: AngularRate | None = None
    ) -> Turns:
        """Approach a tool velocity in the base frame and keep it; see `speedj`."""
        twist, acceleration, guidance = np.array(xd), _within(a, "acceleration"), self._access.guidance
        angular = acceleration if aRot is None else aRot
        return self._arm.guide(
            lambda shaped: guidance.move_tool(twist, acceleration, angular, shaped=shaped), self._wait(t)
        )

    @costs(150)
    def stopj(self, a: args.Positive = 2) -> Turns:
        """Stop with a joint deceleration."""
        deceleration = _within(a, "acceleration", self._acceleration)
        return self._arm.halt(lambda: self._access.guidance.stop_joints(deceleration))

    @costs(150)
    def stopl(self, a: ToolRate = 1.2, aRot: AngularRate | None = None) -> Turns:
        """Stop with a tool deceleration."""
        deceleration = _within(a, "acceleration")
        angular = deceleration if aRot is None else aRot
        return self._arm.halt(lambda: self._access.guidance.stop_tool(deceleration, angular))

    # ------------------------------------------------------------------ arguments

    @property
    def _reference(self) -> Floats:
        return self._access.guidance.reference

    def _wait(self, t: float | None) -> Iterator[None]:
        """Wait for t [s]; if t is None, wait until the velocity is reached."""
        if t:
            yield from self._arm.in_motion(t)
            return
        yield
        while isinstance(speed := self._access.guidance.guided, VelocityFollower) and speed.duration > 0.0:
            yield

    def _posture(self, name: str, value: object) -> tuple[float, ...]:
        """Return joint positions within range; `value` is joint positions or a pose."""
        if isinstance(value, Pose):
            return self._kinematics.posture(args.pose(name, value), self._near)
        q = args.numbers(name, value, self._access.description.joints)
        with refusals_as_faults():
            check_joints(q, self._access.description, name)
        return q

    def _pose(self, name: str, value: object) -> tuple[float, float, float, float, float, float]:
        if isinstance(value, Pose):
            return args.pose(name, value)
        if not isinstance(value, Array):
            raise Fault(f"{name} is {args.shown(value)}: it must be a pose or a list of joint positions")
        return self._kinematics.tool_pose(
            np.array(args.numbers(name, value, self._access.description.joints))
        )

    @property
    def _near(self) -> Sequence[float]:
        """Posture at the start of the next move."""
        here: list[float] = self._reference.tolist()
        if (end := self._arm.end) is None:
            return here
        return end.q if isinstance(end, JointSegment) else self._kinematics.posture(end.pose, here)


def _within(value: float, name: str, most: float = np.inf) -> float:
    """Clamp a velocity or acceleration: at most what the arm permits, at least what moves the arm."""
    return min(max(value, SLOWEST[name]), most)

"""One control period: the paper's Figure 6, left to right."""

from typing import TypeVar

import numpy as np
from msgspec import Struct

from tvist_controller.control.differentiator import Differentiator, Floats, Target
from tvist_controller.control.inverse_dynamics import InverseDynamics
from tvist_controller.control.joint_controllers import JointControllers
from tvist_controller.control.shaped_reference import ShapedReference
from tvist_controller.line_filter import LineFilter
from tvist_controller.look_ahead import LookAhead
from tvist_controller.safety import StreamTorqueRoom
from tvist_controller.trajectory import (
    JointLine,
    JointStop,
    MotionLimits,
    PlannedMotion,
    Rest,
    SetpointStream,
    Trajectory,
    quickest_motion,
)
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement, Plant, check_measurement
from tvist_shaping.base import Filter

T = TypeVar("T", bound=Trajectory)

STILL = 1e-7
"""A reference that moves less than this between two ticks is at rest [rad]."""


class Sample(Struct, frozen=True, eq=False, gc=False):
    """What went along the line in one tick."""

    reference: Floats
    """q before shaping, shape (n,) [rad]."""
    target: Target
    """q* and its derivatives, of the tick before: central differences cost one."""
    torque: Floats
    """τ* of the rigid arm for that target, shape (n,) [N m]."""
    fed_forward: Floats
    """Torque with rotors and friction, as the drives receive it, shape (n,) [N m]."""
    measured: Measurement
    """What the arm did."""


class ControlCycle:
    """Trajectory generator, TVIST filter, differentiator, inverse dynamics, joint controllers, plant.

    Args:
        description: The robot.
        tvist: The filter, with its shaper and estimator.
        q: Joint angles at which the arm rests at the start, shape (n,) [rad].
        declared: The payload that inverse dynamics counts on.
        carried: The payload that the arm has.
        seed: Seed of the arm's noise and gear errors.
        plant: What the line moves; None: the flexible arm that the description describes.

    Raises:
        ValueError: The plant cannot start there, or what it measures has the wrong shape.
    """

    def __init__(
        self,
        description: RobotDescription,
        tvist: Filter,
        *,
        q: Floats,
        declared: Payload,
        carried: Payload,
        seed: int,
        plant: Plant | None = None,
    ) -> None:
        self.description = description
        limits = description.limits
        most = MotionLimits(min(limits.velocity), min(limits.acceleration), min(limits.jerk))
        self.line_filter = LineFilter(tvist, most)
        self._plant: Plant = FlexibleArm(description, carried) if plant is None else plant
        self.inverse_dynamics = InverseDynamics(description, declared)
        self._joint_controllers = JointControllers(description, PERIOD)
        self._shaped = ShapedReference(q, PERIOD)
        self.trajectory: Trajectory = Rest(q)
        self.reference = q
        """Newest one before shaping, shape (n,) [rad]."""
        self.at_rest = True
        """Whether nothing moves the shaped reference any more."""
        self.stopping = False
        """Whether a stop bypasses the filter."""
        self.running_out = False
        """Whether what was under way comes to rest by itself, since no stop is quicker."""
        self.guard: LookAhead | None = None
        """Asked before each shaped reference is played; where it answers with a stop, that is made instead."""
        self.reset(q, carried=carried, seed=seed)
        check_measurement(self.standing.measured, description.joints, self._plant)
        # The first steps load compiled code, which lasts many ticks: they are made here, and taken back.
        self.line_filter.rehearse(q)
        for _ in range(3):
            self.step()
        self.reset(q, seed=seed)

    @property
    def plant(self) -> Plant:
        """What the line moves; the line alone steps and resets it."""
        return self._plant

    @property
    def tvist(self) -> Filter:
        """The filter chosen last: in force, or about to be."""
        return self.line_filter.tvist

    def step(self) -> Sample:
        """One tick."""
        x = self.trajectory.next()  # a path's parameter, or q itself [rad]
        x_star = x if self.stopping else self.line_filter.filter(x)  # x* [rad]
        if self.guard is not None:
            x, x_star = self._guarded(self.guard, x, x_star)
        self.reference = reference = self._shaped.posture(x)  # q [rad]
        target = self._shaped.update(x_star)  # q*, q̇*, q̈* of the tick before
        self.inverse_dynamics.advance()
        torque = self.inverse_dynamics.torque(target.q, target.qd, target.qdd)  # τ* [N m]
        gravity = self.inverse_dynamics.gravity(target.q)
        command = self._joint_controllers.command(target, torque, gravity)
        measured = self._plant.step(command)
        self._settle(reference, target)
        return Sample(reference, target, torque, command.torque, measured)

    def _guarded(self, guard: LookAhead, reference: Floats, shaped: Floats) -> tuple[Floats, Floats]:
        """Return the stream's reference, or that of a stop if no collision-free stop would lead on from it."""
        stop = None if self.stopping else guard(self._shaped.joints.after(shaped))
        if stop is None:
            return reference, shaped
        self.bypass(stop)
        reference = stop.next()
        return reference, reference

    def use(self, tvist: Filter) -> None:
        """Change the filter: at once where the arm is at rest, else within the limits of the motion.

        While one change is under way the next waits for its turn; of several that wait the newest does.

        Args:
            tvist: The filter to come; its joints and period are the present one's.
        """
        if self.at_rest or self.stopping:
            self.line_filter.begin(tvist, self.reference)
        else:
            self.line_filter.use(tvist)

    def _settle(self, reference: Floats, target: Target) -> None:
        """Notice the end of a motion: its trajectory is over and the shaped reference rests on it."""
        trajectory = self.trajectory
        if self.at_rest or not (trajectory.finished or (self.running_out and trajectory.standing)):
            return
        if not ((self.stopping or self.line_filter.settled) and rests(reference, target)):
            return
        leaves = self._shaped.posture_of is not None
        if self.stopping or leaves:  # the delay line starts anew from where it ended
            self._shaped.enter(None, reference)
            self.line_filter.begin(self.tvist, reference)
        if leaves or not trajectory.finished:  # what ran out was paused: it goes no further
            self.trajectory = Rest(reference)
        self.at_rest, self.stopping, self.running_out, self.guard = True, False, False, None

    @property
    def position(self) -> Floats:
        """Position of the shaped reference, shape (n,) [rad]."""
        return self._shaped.joints.position

    def plan(self, target: Floats, limits: MotionLimits, speed: float = 1.0) -> PlannedMotion:
        """A point-to-point motion from where the reference is; the arm must be at rest.

        Args:
            target: Joint positions, shape (n,) [rad].
            limits: For every joint.
            speed: Rate of its time against the clock's to start with [-].

        Raises:
            ValueError: There is no such motion.
        """
        return quickest_motion(JointLine(self.reference, target), limits, PERIOD, speed)

    def stream(self, stream_period: float, limits: MotionLimits) -> SetpointStream:
        """Start to follow set-points; the arm must be at rest."""
        self.tvist.aim(None)
        reach = np.array(self.description.limits.position)
        torque = StreamTorqueRoom(self.description, self.inverse_dynamics)
        return self.start(
            SetpointStream(self.reference, stream_period, limits, PERIOD, reach=reach, torque=torque)
        )

    def start(self, trajectory: T) -> T:
        """Follow a trajectory that begins where the reference is; one on another path than before begins at rest."""
        path = trajectory.path
        if path is not None and path.posture_of != self._shaped.posture_of:
            self._shaped.enter(path.posture_of, path.start)
            self.line_filter.begin(self.tvist, path.start, path.posture_of)
        if trajectory.limits is not None:
            self.line_filter.limits = trajectory.limits
        self.trajectory, self.at_rest = trajectory, False
        return trajectory

    def end_of(self, stream: SetpointStream) -> JointStop:
        """How a stream comes to rest inside its own limits, through the filter."""
        limits = stream.limits
        return JointStop(*stream.state, acceleration=limits.acceleration, jerk=limits.jerk, period=PERIOD)

    @property
    def newest(self) -> Target:
        """State of motion of the joints at the newest shaped reference."""
        return self._shaped.joints.newest

    @property
    def along(self) -> Differentiator:
        """State of motion of the filter's samples: of a path's parameter, or of the joints."""
        return self._shaped.along

    def fork(self) -> tuple[Trajectory, LineFilter, ShapedReference]:
        """Copies of the line's parts that make targets, to be run ahead."""
        return self.trajectory.fork(), self.line_filter.fork(), self._shaped.fork()

    def run_out(self) -> None:
        """Come to rest by letting what is under way go on: where it is paused it goes no further."""
        self.running_out = True

    def bypass(self, stop: Trajectory) -> None:
        """Come to rest past the filter; nothing in the delay line plays on.

        Args:
            stop: Continues the shaped reference.
        """
        self.trajectory, self.at_rest = stop, False
        if stop.path is None:
            self._shaped.enter(None, self.position)
        self.line_filter.cut()
        self.stopping, self.running_out = True, False

    def reset(self, q: Floats, *, carried: Payload | None = None, seed: int = 0) -> None:
        """Put the arm at rest somewhere, in static equilibrium; everything on the line starts anew."""
        self.trajectory, self.reference = Rest(q), q
        self.at_rest, self.stopping, self.running_out, self.guard = True, False, False, None
        self.inverse_dynamics.settle()
        self.line_filter.begin(self.tvist, q)
        self._shaped.reset(q)
        self._joint_controllers.reset()
        still = np.zeros_like(q)
        torque = self.inverse_dynamics.gravity(q)
        command = self._joint_controllers.command(Target(q, still, still), torque, torque)
        measured = self._plant.reset(command, payload=carried, seed=seed)
        self.standing = Sample(q, Target(q, still, still), torque, command.torque, measured)
        """What there is to tell before the first tick from there."""

    def declare(self, payload: Payload) -> None:
        """Change the payload that inverse dynamics counts on; torque goes there without a step."""
        self.inverse_dynamics.declare(payload)


def rests(reference: Floats, target: Target) -> bool:
    """Whether a shaped reference rests on its reference, by the target that was made of it.

    Args:
        reference: Before shaping, shape (n,) [rad].
        target: That was made of it.
    """
    # What central differences make of q*ᵢ - q*ᵢ₋₁.
    step = PERIOD * (target.qd - 0.5 * PERIOD * target.qdd)
    return bool(max(np.abs(step).max(), np.abs(reference - target.q).max()) <= STILL)

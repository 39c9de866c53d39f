"""One control period: the paper's Figure 6, left to right."""

from typing import TypeVar

import numpy as np
from msgspec import Struct

from tvist_controller.control.differentiator import Differentiator, Floats, Target
from tvist_controller.control.drive_feed_forward import DriveFeedForward, MotorReference
from tvist_controller.control.elastic_feed_forward import ElasticFeedForward
from tvist_controller.control.inverse_dynamics import SLEW, InverseDynamics
from tvist_controller.control.line_tick import Q_R, SIGNALS, STATIC, TORQUE, UNSHAPED_Q, Q, to_drives
from tvist_controller.control.shaped_reference import ShapedReference
from tvist_controller.control.unshaped_reference import UnshapedReference
from tvist_controller.line_filter import LineFilter
from tvist_controller.look_ahead import LookAhead, Obstacle
from tvist_controller.safety import StreamTorqueRoom, arm_limits
from tvist_controller.trajectory import (
    Guided,
    JointLine,
    JointStop,
    MotionLimits,
    PlannedMotion,
    Rest,
    SetpointStream,
    StuckError,
    Trajectory,
    quickest_motion,
)
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement, Plant, check_measurement
from tvist_shaping.base import Filter

T = TypeVar("T", bound=Trajectory)

STILL = 1e-7
"""A reference that changes by less than this between two ticks is at rest [rad]."""


class Sample(Struct, frozen=True, eq=False, gc=False):
    """Signals along the control line in one tick."""

    signals: Floats
    """All signals before the arm, shape (12, n), see `line_tick`."""
    reference: Floats
    """q before shaping, shape (n,) [rad]."""
    target: Target
    """q* and its derivatives at the previous tick, since central differences cost one tick of delay."""
    torque: Floats
    """τ* of the rigid arm for that target, shape (n,) [N m]."""
    fed_forward: Floats
    """Torque with rotors and friction, as the drives receive it, shape (n,) [N m]."""
    measured: Measurement
    """Measurement of the arm."""
    apart: bool = False
    """Whether the target differs from what it is without the filter."""
    motors: MotorReference | None = None
    """Motion of the motors that elastic feed-forward asks for; None without it."""

    @property
    def unshaped(self) -> Target | None:
        """What the target is without the filter, at the same tick; None if it is the target itself, to the last bit."""
        return Target(*self.signals[UNSHAPED_Q:STATIC]) if self.apart else None


class ControlCycle:
    """Trajectory generator, TVIST filter, differentiator, inverse dynamics, joint controllers, plant.

    Args:
        description: The robot.
        tvist: The filter, with its shaper and estimator.
        q: Joint angles at which the arm is at rest initially, shape (n,) [rad].
        declared: Payload that inverse dynamics uses.
        carried: Payload that the arm carries.
        seed: Seed of the arm's noise and gear errors.
        plant: Plant to control; None for the flexible arm of the description.
        elastic: Elastic feed-forward to use with the filter; None for that of the paper's controller.
        compensate_sag: Whether the drives lead by the twist of the gears under gravity.

    Raises:
        ValueError: The plant cannot start there, or its measurement has the wrong shape.
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
        elastic: ElasticFeedForward | None = None,
        compensate_sag: bool = False,
    ) -> None:
        self.description = description
        self.line_filter = LineFilter(tvist, arm_limits(description))
        self._plant: Plant = FlexibleArm(description, carried) if plant is None else plant
        self.inverse_dynamics = InverseDynamics(description, declared)
        self._feed_forward = DriveFeedForward(description, PERIOD, compensate_sag=compensate_sag)
        self._feed_forward.use(elastic)
        self._shaped = ShapedReference(q, PERIOD)
        self._unshaped = UnshapedReference()
        self.trajectory: Trajectory = Rest(q)
        self.reference = q
        """Newest reference before shaping, shape (n,) [rad]."""
        self.at_rest = True
        """Whether the shaped reference has come to rest."""
        self.unshaped = False
        """Whether the trajectory bypasses the filter."""
        self.stopping = False
        """Whether the trajectory is a stop, which bypasses the filter."""
        self.running_out = False
        """Whether the present motion comes to rest by itself, since no stop is quicker."""
        self.guard: LookAhead | None = None
        """Checks each shaped reference before it is played; if it returns a stop, that is followed instead."""
        self.refused: Obstacle | None = None
        """Why the latest reference was not played, so that a stop was made instead; None if it was played."""
        self.reset(q, carried=carried, seed=seed)
        check_measurement(self.standing.measured, description.joints, self._plant)
        # The first steps load compiled code, which takes many ticks; they are made here, and undone.
        self.line_filter.rehearse(q)
        for _ in range(3):
            self.step()
        self.reset(q, seed=seed)

    @property
    def plant(self) -> Plant:
        """The plant; only the control line steps and resets it."""
        return self._plant

    @property
    def elastic(self) -> ElasticFeedForward | None:
        """The latest chosen elastic feed-forward: in use, or about to be; None for that of the paper's controller."""
        return self._feed_forward.wanted

    @property
    def drive_delay(self) -> float:
        """Time by which commands for the drives are later than their targets [s]."""
        return self._feed_forward.delay

    @property
    def tvist(self) -> Filter:
        """The latest chosen filter: in use, or about to be."""
        return self.line_filter.tvist

    def step(self) -> Sample:
        """Compute one tick."""
        self.refused = None
        try:
            x = self.trajectory.next()  # a path's parameter, or q itself [rad]
        except StuckError as error:
            x = self._give_up(error)
        x_star = x if self.unshaped else self.line_filter.filter(x)  # x* [rad]
        if self.guard is not None:
            x, x_star = self._guarded(self.guard, x, x_star)
        self.reference = reference = self._shaped.posture(x)  # q [rad]
        # Comparing bytes is several times as fast as comparing arrays.
        alike, unshaped = x_star is x or x_star.tobytes() == x.tobytes(), None
        if not alike or self._unshaped.apart is not None:
            unshaped = self._unshaped.push(reference, self._shaped.joints, alike=alike)
        self._shaped.push(x_star, reference if alike else None)
        self.inverse_dynamics.advance()
        # Differentiator, inverse dynamics and joint controllers: q*, q̇*, q̈* a tick earlier, τ* [N m], the command
        signals = self._to_drives(unshaped)
        q, qd, qdd, torque = signals[Q : TORQUE + 1]
        target, plain = Target(q, qd, qdd), DriveCommand(*signals[Q_R:])
        command = self._feed_forward.command(
            target, torque, signals[STATIC], self.inverse_dynamics.carried, plain,
            may_begin=not (self.unshaped or self.line_filter.fading), may_go_on=not self.unshaped or self.stopping,
        )  # fmt: skip
        measured = self._plant.step(command)
        self._settle(reference, target)
        motors = self._feed_forward.reference
        return Sample(
            signals, reference, target, torque, command.torque, measured, unshaped is not None, motors
        )

    @property
    def kernel_parts(self) -> tuple[Floats, float, Floats, Floats]:
        """Links, gravity, scratch and joint controllers, as `line_tick` takes them."""
        dynamics = self.inverse_dynamics
        return dynamics.chain, dynamics.gravitation, dynamics.scratch, self._feed_forward.rows

    def _to_drives(self, unshaped: Differentiator | None) -> Floats:
        """Return the signals from the shaped reference to the drives, shape (12, n), see `line_tick`.

        Args:
            unshaped: State of motion without the filter; None if it is the same.
        """
        joints = self._shaped.joints
        window, other = joints.window, (joints if unshaped is None else unshaped).window
        signals = np.empty((SIGNALS, len(window[1])))
        chain, gravitation, scratch, rows = self.kernel_parts
        to_drives(*window, *other, PERIOD, chain, gravitation, scratch, rows, signals)
        return signals

    def _give_up(self, error: StuckError) -> Floats:
        """Return the first reference of the stop from the last shaped one, since the trajectory cannot go on."""
        assert self.guard is not None, "what may be stuck is guarded"
        stop = self.guard.give_up(str(error))
        self.bypass(stop)
        self.refused = self.guard.obstacle
        return stop.next()

    def _guarded(self, guard: LookAhead, reference: Floats, shaped: Floats) -> tuple[Floats, Floats]:
        """Return the reference and its shaped one, or those of a stop if no clear stop leads on from them."""
        stop = None if self.stopping else guard(self._shaped.joints.after(shaped))
        if stop is None:
            return reference, shaped
        self.bypass(stop)
        self.refused = guard.obstacle
        reference = stop.next()
        return reference, reference

    def use(self, tvist: Filter, elastic: ElasticFeedForward | None = None) -> None:
        """Change the filter: at once if the arm is at rest, else within the limits of the motion.

        If a change is under way, the new filter waits until that is complete; only the latest waiting filter is kept.

        Args:
            tvist: New filter, with the joints and the period of the present one.
            elastic: Elastic feed-forward to use with it; None for that of the paper's controller.
        """
        self._feed_forward.use(elastic)
        if self.at_rest:
            self._feed_forward.rest()
        if self.at_rest or self.unshaped:
            self.line_filter.begin(tvist, self.reference)
        else:
            self.line_filter.use(tvist)
            if isinstance(self.trajectory, SetpointStream):
                self.trajectory.slow_down(self.spared(self.trajectory.limits))
            elif isinstance(self.trajectory, Guided):
                self.trajectory.adopt(self.spared(arm_limits(self.description)))

    def _settle(self, reference: Floats, target: Target) -> None:
        """Detect the end of a motion: its trajectory is finished and the shaped reference has come to rest on it."""
        trajectory = self.trajectory
        if self.at_rest or not (trajectory.finished or (self.running_out and trajectory.standing)):
            return
        if not ((self.unshaped or self.line_filter.settled) and rests(reference, target)):
            return
        leaves = self._shaped.posture_of is not None
        if self.unshaped or leaves:  # the delay line restarts from where the motion ended
            self._shaped.enter(None, reference)
            self.line_filter.begin(self.tvist, reference)
        if leaves or not trajectory.finished:  # a motion that ran out while paused ends here
            self.trajectory = Rest(reference)
        self.at_rest, self.unshaped, self.guard = True, False, None
        self.stopping = self.running_out = False
        self._feed_forward.rest()

    @property
    def position(self) -> Floats:
        """Position of the shaped reference, shape (n,) [rad]."""
        return self._shaped.joints.position

    def plan(self, target: Floats, limits: MotionLimits, speed: float = 1.0) -> PlannedMotion:
        """Plan a point-to-point motion from the present reference; the arm must be at rest.

        Args:
            target: Joint positions, shape (n,) [rad].
            limits: Limits for every joint.
            speed: Initial rate of the motion's time relative to the clock's [-].

        Raises:
            ValueError: There is no such motion.
        """
        return quickest_motion(JointLine(self.reference, target), limits, PERIOD, speed)

    def spared(self, limits: MotionLimits) -> MotionLimits:
        """Return the limits of a reference whose shaped reference keeps these limits and those of the arm."""
        faster, harder = (1.0 + more for more in self.tvist.surplus)
        arms = arm_limits(self.description)
        return MotionLimits(
            min(limits.velocity, arms.velocity / faster),
            min(limits.acceleration, arms.acceleration / harder),
            limits.jerk,
        )

    def stream(self, stream_period: float, limits: MotionLimits) -> SetpointStream:
        """Start to follow set-points; the arm must be at rest."""
        self.tvist.aim(None)
        reach = np.array(self.description.limits.position)
        torque = StreamTorqueRoom(self.description, self.inverse_dynamics)
        return self.start(
            SetpointStream(
                self.reference, stream_period, self.spared(limits), PERIOD, reach=reach, torque=torque
            )
        )

    def start(self, trajectory: T) -> T:
        """Follow a trajectory from the present reference; if its path is a different one, the arm must be at rest."""
        path = trajectory.path
        if path is not None and path.posture_of != self._shaped.posture_of:
            self._shaped.enter(path.posture_of, path.start)
            self.line_filter.begin(self.tvist, path.start, path.posture_of)
        if trajectory.limits is not None:
            self.line_filter.limits = trajectory.limits
        self.trajectory, self.at_rest = trajectory, False
        return trajectory

    def end_of(self, stream: SetpointStream) -> JointStop:
        """Return how a stream comes to rest inside its own limits, through the filter."""
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
        """Return copies of the line's parts that generate targets, for simulation ahead of time."""
        return self.trajectory.fork(), self.line_filter.fork(), self._shaped.fork()

    def run_out(self) -> None:
        """Come to rest by completing the present motion; a paused motion ends where it is."""
        self.running_out = True

    def bypass(self, stop: Trajectory) -> None:
        """Come to rest without the filter; the contents of the delay line are not played.

        Args:
            stop: Stop that continues the shaped reference.
        """
        self.follow(stop)
        self.stopping = True

    def follow(self, trajectory: Trajectory) -> None:
        """Follow a trajectory without the filter; the contents of the delay line are not played.

        Args:
            trajectory: Trajectory that continues the shaped reference.
        """
        self.trajectory, self.at_rest = trajectory, False
        if trajectory.path is None:
            self._shaped.enter(None, self.position)
        self._unshaped.join()
        self.line_filter.cut()
        self.unshaped, self.stopping, self.running_out = True, False, False

    def reset(self, q: Floats, *, carried: Payload | None = None, seed: int = 0) -> None:
        """Place the arm somewhere at rest, in static equilibrium; the whole line restarts."""
        self.trajectory, self.reference = Rest(q), q
        self.at_rest, self.unshaped, self.guard = True, False, None
        self.stopping = self.running_out = False
        self.inverse_dynamics.settle()
        self.line_filter.begin(self.tvist, q)
        self._shaped.reset(q)
        self._unshaped.join()
        self._feed_forward.reset(self.inverse_dynamics.gravity(q))
        signals = self._to_drives(None)
        target, torque, plain = Target(*signals[Q:TORQUE]), signals[TORQUE], DriveCommand(*signals[Q_R:])
        command = self._feed_forward.command(
            target, torque, signals[STATIC], self.inverse_dynamics.carried, plain
        )
        measured = self._plant.reset(command, payload=carried, seed=seed)
        self.standing = Sample(signals, q, target, torque, command.torque, measured)
        """Signals to report before the first tick from there."""

    def declare(self, payload: Payload, ticks: int = SLEW) -> None:
        """Change the payload that inverse dynamics uses, over some ticks; the torque has no step."""
        self.inverse_dynamics.declare(payload, ticks)


def rests(reference: Floats, target: Target) -> bool:
    """Return whether a shaped reference has come to rest at the unshaped one, judged by the target computed from it.

    Args:
        reference: Reference before shaping, shape (n,) [rad].
        target: Target computed from the shaped reference.
    """
    # The central differences' equivalent of q*ᵢ - q*ᵢ₋₁.
    step = PERIOD * (target.qd - 0.5 * PERIOD * target.qdd)
    return bool(max(np.abs(step).max(), np.abs(reference - target.q).max()) <= STILL)

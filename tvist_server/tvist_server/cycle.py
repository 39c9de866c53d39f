"""One control period: the paper's Figure 6, left to right."""

import math
from typing import TypeVar

import numpy as np
from msgspec import Struct

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import PERIOD, Measurement, Plant
from tvist_server.control.differentiator import Differentiator, Floats, Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.control.joint_controllers import JointControllers
from tvist_server.safety import StopPlan, TorqueRoom, plan_stop
from tvist_server.trajectory import DoubleS, Limits, Rest, SetpointStream, Stop, Trajectory
from tvist_shaping.base import Filter
from tvist_shaping.fade import Fade

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
    """The same with rotors and friction, as the drives get it, shape (n,) [N m]."""
    measured: Measurement
    """What the arm did."""


class ControlCycle:
    """Trajectory generator, TVIST filter, differentiator, inverse dynamics, joint controllers, arm.

    Args:
        description: The robot.
        tvist: The filter, with its shaper and estimator.
        q: Where the arm rests at the start, shape (n,) [rad].
        declared: The payload that inverse dynamics counts on.
        carried: The payload that the arm has.
        seed: Of the arm's noise and gear errors.
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
    ) -> None:
        self.description = description
        self.tvist = tvist
        """The filter chosen last: in force, or about to be."""
        self._fade: Fade | None = None
        self._limits = Limits(
            min(description.limits.velocity),
            min(description.limits.acceleration),
            min(description.limits.jerk),
        )
        """Of the present motion."""
        self.arm = Plant(description, carried)
        self.inverse_dynamics = InverseDynamics(description, declared)
        self._joint_controllers = JointControllers(description, PERIOD)
        self._differentiator = Differentiator(q, PERIOD)
        self.trajectory: Trajectory = Rest(q)
        self.reference = q
        """Newest one before shaping, shape (n,) [rad]."""
        self.at_rest = True
        """Whether nothing moves the shaped reference any more."""
        self.stopping = False
        """Whether a stop bypasses the filter."""
        self._deceleration = math.inf
        self.reset(q, carried=carried, seed=seed)
        # The first steps load compiled code, which lasts many ticks: they are made here, and taken back.
        self._fade = self._fade_to(tvist.with_estimator(tvist.estimator), tvist)
        for _ in range(3):
            self.step()
        self.reset(q, seed=seed)

    def step(self) -> Sample:
        """One tick."""
        reference = self.reference = self.trajectory.next()  # q [rad]
        shaped = reference if self.stopping else self._shape(reference)  # q* [rad]
        target = self._differentiator.update(shaped)  # q*, q̇*, q̈* of the tick before
        self.inverse_dynamics.advance()
        torque = self.inverse_dynamics.torque(target.q, target.qd, target.qdd)  # τ* [N m]
        gravity = self.inverse_dynamics.gravity(target.q)
        command = self._joint_controllers.command(target, torque, gravity)
        measured = self.arm.step(command)
        self._settle(reference, target)
        return Sample(reference, target, torque, command.torque, measured)

    def _shape(self, reference: Floats) -> Floats:
        """Shaped reference, on the way from one filter to another where there is one."""
        fade = self._fade
        if fade is None:
            return self.tvist.filter(reference)
        shaped = fade.filter(reference)
        if fade.new is not self.tvist:  # it waits for its turn
            self.tvist.filter(reference)
        if fade.finished:
            self._fade = None if fade.new is self.tvist else self._fade_to(fade.new, self.tvist)
        return shaped

    def _fade_to(self, old: Filter, new: Filter) -> Fade:
        limits = self._limits
        return Fade(old, new, velocity=limits.velocity, acceleration=limits.acceleration, jerk=limits.jerk)

    def use(self, tvist: Filter) -> None:
        """Change the filter: at once where the arm is at rest, else within the limits of the motion.

        While one change is under way the next waits for its turn; of several that wait the newest does.

        Args:
            tvist: The filter to come; its joints and period are the present one's.
        """
        fade = self._fade
        if self.at_rest or self.stopping:
            tvist.reset(self.reference)
        elif fade is None or fade.share == 0.0:
            self._fade = self._fade_to(self.tvist if fade is None else fade.old, tvist)
        else:
            tvist.take_over(self.tvist)
        self.tvist = tvist

    def _settle(self, reference: Floats, target: Target) -> None:
        """Notice the end of a motion: its trajectory is over and the shaped reference rests on it."""
        if self.at_rest or self._fade is not None or not self.trajectory.finished:
            return
        step = PERIOD * (
            target.qd - 0.5 * PERIOD * target.qdd
        )  # what central differences make of q*ᵢ - q*ᵢ₋₁
        way_left = reference - target.q
        self.at_rest = bool(max(np.abs(step).max(), np.abs(way_left).max()) <= STILL)
        if self.at_rest and self.stopping:  # the delay line starts anew from where the stop ended
            self.tvist.reset(reference)
            self.stopping = False

    @property
    def position(self) -> Floats:
        """Where the shaped reference is, shape (n,) [rad]."""
        return self._differentiator.newest.q

    def plan(self, target: Floats, limits: Limits, speed: float = 1.0) -> DoubleS:
        """A point-to-point motion from where the reference is; the arm must be at rest.

        Args:
            target: Joint positions, shape (n,) [rad].
            limits: For every joint.
            speed: Rate of its time against the clock's to start with [-].

        Raises:
            ValueError: There is no such motion.
        """
        return DoubleS(self.reference, target, limits, PERIOD, speed)

    def stream(self, stream_period: float, limits: Limits) -> SetpointStream:
        """Start to follow set-points; the arm must be at rest."""
        self.tvist.aim(None)
        reach = np.array(self.description.limits.position)
        torque = TorqueRoom(self.description, self.inverse_dynamics)
        return self.start(
            SetpointStream(self.reference, stream_period, limits, PERIOD, reach=reach, torque=torque)
        )

    def start(self, trajectory: T) -> T:
        """Follow a trajectory that begins where the reference is."""
        self.trajectory = trajectory
        if isinstance(trajectory, DoubleS | SetpointStream):
            self._limits = trajectory.limits
        self.at_rest = False
        return trajectory

    def end_stream(self, stream: SetpointStream) -> None:
        """Bring a stream to rest inside its own limits, through the filter."""
        limits = stream.limits
        self.start(Stop(*stream.state, acceleration=limits.acceleration, jerk=limits.jerk, period=PERIOD))

    @property
    def newest(self) -> Target:
        """State of motion of the newest shaped reference."""
        return self._differentiator.newest

    def plan_stop(self, deceleration: float | None) -> StopPlan:
        """The stop that could be made now; deceleration as of `stop`."""
        return plan_stop(self.description, self.inverse_dynamics, self.newest, deceleration, PERIOD)

    def stop(self, deceleration: float | None) -> StopPlan | None:
        """Stop past the filter, straight from the shaped reference; nothing in the delay line plays on.

        Args:
            deceleration: Wanted limit [rad/s^2]; None for what the torque allows.

        Returns:
            The stop with the limit it keeps; None where a stop under way is as hard already, and goes on.
        """
        wanted = math.inf if deceleration is None else deceleration
        if self.stopping and wanted <= self._deceleration:
            return None
        plan = self.plan_stop(deceleration)
        self.start(plan.trajectory)
        self.stopping, self._deceleration, self._fade = True, wanted, None
        return plan

    def reset(self, q: Floats, *, carried: Payload | None = None, seed: int = 0) -> None:
        """Put the arm at rest somewhere, in static equilibrium; everything on the line starts anew."""
        self.trajectory, self.reference = Rest(q), q
        self.at_rest, self.stopping, self._fade = True, False, None
        self.inverse_dynamics.settle()
        self.tvist.reset(q)
        self._differentiator.reset(q)
        self._joint_controllers.reset()
        still = np.zeros_like(q)
        torque = self.inverse_dynamics.gravity(q)
        command = self._joint_controllers.command(Target(q, still, still), torque, torque)
        self.arm.reset(command, payload=carried, seed=seed)

    def declare(self, payload: Payload) -> None:
        """Change the payload that inverse dynamics counts on; torque goes there without a step."""
        self.inverse_dynamics.declare(payload)

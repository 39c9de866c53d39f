"""Guided motions, each command of which replaces the one before: `servo_j`, `speed_j`, `speed_l`."""

from typing import TypeVar

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turn, turned
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import GENTLEST_STOP, REBOUND, StreamTorqueMargin, arm_limits
from tvist_controller.line.line_mode import LineMode
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.refusal import invalid
from tvist_controller.trajectory import Compliant, Guided, MotionLimits, ServoFollower, VelocityFollower
from tvist_protocol.transitions import Activity

G = TypeVar("G", bound=Guided)


class Guidance:
    """Starts guided motions, from rest or by taking over a motion, and stops them.

    A guided motion is unshaped unless its first command comes at rest and requests shaping. An unshaped one
    starts from the newest shaped reference of any motion. Later commands continue the same reference.
    """

    def __init__(self, motion: MotionControl) -> None:
        self.motion = motion
        self._cycle = motion.cycle
        self.limits = arm_limits(motion.cycle.description)
        self.reach = np.array(motion.cycle.description.limits.position)
        """Position limit of each joint, shape (n,) [rad]."""
        self.torque = StreamTorqueMargin(motion.cycle.description, motion.cycle.dynamics, REBOUND)
        """Accelerations that torque permits."""
        self._rehearse()

    def _rehearse(self) -> None:
        """Compile or load the kernels of a tool motion before a tick needs them."""
        q, still, arm = self.reach * 0.1, np.zeros(len(self.reach)), self.motion.tool
        speed = VelocityFollower((q, still, still), self.limits, self.torque, arm=arm)
        speed.aim(arm.jacobian(q)[:, 0] * 1e-3, 1.0, 1.0)
        speed.next()
        rotation, position = arm.pose(q)
        arm.near((turned(rotation, turn(rotation, rotation)), position), q)

    def servo(self, q: Floats, lookahead: float, gain: float, *, shaped: bool) -> int:
        """Follow a posture, see `ServoFollower`; return the motion's number; RefusalError as in `check`."""
        self.check("servo_j", shaped=shaped)
        servo = self._present(ServoFollower, shaped) or ServoFollower(
            self._start(shaped), self._most(shaped), self.reach, self.torque
        )
        servo.aim(q, lookahead, gain)
        return self.follow("servo_j", servo, shaped=shaped)

    def move_joints(self, qd: Floats, acceleration: float, *, shaped: bool) -> int:
        """Approach joint velocities; return the motion's number; RefusalError as in `check`."""
        self.check("speed_j", shaped=shaped)
        if shaped:
            most = self._most(shaped).velocity
            qd = qd * min(1.0, most / max(float(np.abs(qd).max()), most))
        return self._approach("speed_j", None, qd, (acceleration,), shaped=shaped)

    def move_tool(
        self, twist: Floats, acceleration: float, angular_acceleration: float, *, shaped: bool
    ) -> int:
        """Approach a tool velocity; return the motion's number; RefusalError as in `check`."""
        self.check("speed_l", shaped=shaped)
        accelerations = (acceleration, angular_acceleration)
        return self._approach("speed_l", self.motion.tool, twist, accelerations, shaped=shaped)

    def _approach(
        self, trigger: str, tool: Arm | None, goal: Floats, accelerations: tuple[float, ...], *, shaped: bool
    ) -> int:
        speed = self._present(VelocityFollower, shaped)
        if speed is None or speed.arm is not tool:
            rate = self.motion.motions.speed
            speed = VelocityFollower(
                self._start(shaped), self._most(shaped), self.torque, rate=rate, arm=tool
            )
        speed.aim(goal, *accelerations)
        return self.follow(trigger, speed, shaped=shaped)

    def stop_joints(self, acceleration: float | None, trigger: str = "stop_j") -> None:
        """Come to rest, all joints in phase, at a deceleration [rad/s^2]; None for what torque permits."""
        motion = self.motion
        if motion.activity is not Activity.GUIDED or acceleration is None:
            motion.end(trigger, f"{trigger} was commanded", deceleration=acceleration)
            return
        acceleration = min(max(acceleration, GENTLEST_STOP), self.limits.acceleration)
        stop = self.halting(self.state, acceleration)
        stop.acceleration = acceleration
        self._halt(trigger, stop, stop.duration)

    def stop_tool(self, acceleration: float, angular_acceleration: float) -> None:
        """Stop with a deceleration of the tool [m/s^2, rad/s^2]; a tool moved by `speed_l` stays straight."""
        cycle = self._cycle
        state, present, tool = cycle.newest, cycle.trajectory, self.motion.tool
        fastest, twist = float(np.abs(state.qd).max()), tool.jacobian(state.q) @ state.qd
        duration = max(
            float(np.linalg.norm(twist[:3])) / acceleration,
            float(np.linalg.norm(twist[3:])) / angular_acceleration,
        )
        straight = (
            self.motion.activity is Activity.GUIDED
            and isinstance(present, VelocityFollower)
            and present.arm is not None
        )
        if not straight or duration == 0.0:
            self.stop_joints(fastest / duration if duration > 0.0 else None, "stop_l")
            return
        harder = max(duration * GENTLEST_STOP / fastest, 1.0)
        stop = VelocityFollower(self._start(shaped=False), self.limits, self.torque, arm=tool)
        stop.aim(np.zeros(6), harder * acceleration, harder * angular_acceleration)
        stop.acceleration = harder * fastest / duration
        self._halt("stop_l", stop, stop.duration)

    def _most(self, shaped: bool) -> MotionLimits:
        return self._cycle.filter.reduced_limits(self.limits) if shaped else self.limits

    def check(self, trigger: str, *, shaped: bool = False) -> None:
        """Raise RefusalError if a command is not allowed now, or wants shaping that must begin at rest."""
        self.motion.check(trigger)
        if shaped and self.motion.activity is not Activity.REST and not self._continues(shaped):
            raise invalid("shaped", "true", "false, since this motion does not begin at rest", code="busy")

    def _continues(self, shaped: bool) -> bool:
        """Return whether a command continues the reference of the previous command."""
        return self.motion.activity is Activity.GUIDED and shaped == self._cycle.mode.shaped

    def _present(self, kind: type[G], shaped: bool) -> G | None:
        present = self.guided
        return present if self._continues(shaped) and isinstance(present, kind) else None

    @property
    def compliant(self) -> Compliant | None:
        """The present motion with compliance (force mode or freedrive); None without one."""
        present = self._cycle.trajectory
        guided = self.motion.activity is Activity.GUIDED
        return present if guided and isinstance(present, Compliant) else None

    @property
    def guided(self) -> Guided | None:
        """The present guided motion, also if it is part of a compliant motion; None without one."""
        lead = self.compliant
        found = self._cycle.trajectory if lead is None else lead.inner
        return found if self.motion.activity is Activity.GUIDED and isinstance(found, Guided) else None

    @property
    def reference(self) -> Floats:
        """Joint positions of the present reference without the effect of compliance, shape (n,) [rad]."""
        return self._cycle.sample.reference if self.compliant is None else self.compliant.nominal

    @property
    def resting(self) -> bool:
        """Whether no motion is commanded; compliance may still move the arm."""
        lead = self.compliant
        return not self.motion.activity.moving if lead is None else lead.inner.finished

    @property
    def state(self) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration from which a new unshaped motion starts."""
        return self._start(shaped=False) if self.compliant is None else self.compliant.state

    def stand(self, deceleration: float) -> None:
        """Come to rest in the non-compliant axes, at a deceleration [rad/s^2]."""
        lead = self.compliant
        if lead is None or lead.inner.finished:
            return
        lead.take(self.halting(self._start(shaped=False), deceleration))

    def halting(self, state: tuple[Floats, Floats, Floats], deceleration: float) -> VelocityFollower:
        """Return a trajectory from a state to rest with a deceleration [rad/s^2]."""
        stop = VelocityFollower(state, self.limits, self.torque)
        stop.aim(np.zeros_like(state[0]), deceleration)
        return stop

    def slow_down(self) -> None:
        """Until the next command, bring motion with commanded velocity to rest; a commanded posture stays."""
        if isinstance(present := self.guided, VelocityFollower):
            present.come_to_rest()

    def _start(self, shaped: bool) -> tuple[Floats, Floats, Floats]:
        cycle, lead = self._cycle, self.compliant
        if self._continues(shaped) and (present := self.guided) is not None:
            return present.state
        if lead is not None:  # the inner reference of the compliant motion is at rest
            return lead.nominal, np.zeros_like(lead.nominal), np.zeros_like(lead.nominal)
        if cycle.mode.at_rest:
            q = cycle.sample.reference if shaped else cycle.position
            return q, np.zeros_like(q), np.zeros_like(q)
        newest = cycle.newest
        return newest.q, newest.qd, newest.qdd

    def follow(self, trigger: str, trajectory: Guided, *, shaped: bool = False) -> int:
        """Start a trajectory, during a compliant motion in its stiff axes; return the motion's number."""
        motion, cycle, guard, lead = self.motion, self._cycle, None, self.compliant
        if lead is not None and trajectory is not lead:
            lead.take(trajectory)
            motion.go(trigger)
            return motion.motions.guide(lead)
        if motion.activity is not Activity.GUIDED:
            guard = motion.ahead.guard_of_guided()
            motion.motions.stopped(f"{trigger} took over", None)
        if not shaped:
            cycle.begin(trajectory, LineMode.BYPASSED, guard)
        elif trajectory is not cycle.trajectory:
            if cycle.mode.at_rest:
                cycle.tvist.aim(None)
            cycle.begin(trajectory, LineMode.GUARDED, guard)
        motion.go(trigger)
        return motion.motions.guide(trajectory)

    def _halt(self, trigger: str, stop: Guided, duration: float) -> None:
        """End the guided motion by a trajectory that comes to rest after `duration` [s]."""
        motion, fastest = self.motion, float(np.abs(stop.state[1]).max())
        self._cycle.begin(stop, LineMode.BYPASSED)
        motion.go(trigger)
        why, way = f"{trigger} was commanded", 0.5 * duration * fastest
        motion.motions.stopped(why, None, category=2, duration=duration, way=way)

"""Motions that a client guides by commands, each of which replaces the one before: `servo_j`, `speed_j`, `speed_l`."""

from typing import TypeVar

import numpy as np

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.kinematics.tool import ToolKinematics
from tvist_controller.line.differentiator import Floats
from tvist_controller.line.limits import GENTLEST_STOP, GuidedTorqueRoom, arm_limits
from tvist_controller.line.line_mode import LineMode
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.trajectory import Guided, JointSpeed, MotionLimits, Servo, ToolSpeed
from tvist_plant.plant import PERIOD
from tvist_protocol.transitions import Activity

G = TypeVar("G", bound=Guided)


class Guidance:
    """Starts guided motions, from rest or from a motion that is taken over, and brings them to rest.

    They are not shaped, unless the first command asks for it at rest. One that is not shaped starts from the state of
    the newest shaped reference, whatever moves. A successor continues from the reference of the command before it.

    Args:
        motion: The robot's motion.
    """

    def __init__(self, motion: MotionControl) -> None:
        self._motion, self._cycle = motion, motion.cycle
        self._limits = arm_limits(motion.cycle.description)
        self._reach = np.array(motion.cycle.description.limits.position)
        self._torque = GuidedTorqueRoom(motion.cycle.description, motion.cycle.line.dynamics)
        self._tcp, self._kinematics = motion.tcp, ToolKinematics(motion.cycle.description)
        self._kinematics.rehearse(PERIOD)

    def servo(self, q: Floats, lookahead: float, gain: float, *, shaped: bool) -> int:
        """Follow a posture, see `Servo`; return the motion's number.

        Raises:
            RefusalError: The present activity does not allow it, or its motion cannot be taken over.
        """
        self._check("servo_j", shaped)
        servo = self._present(Servo, shaped)
        if servo is None:
            servo = Servo(self._start(shaped), self._most(shaped), self._reach, self._torque, PERIOD)
        servo.aim(q, lookahead, gain)
        return self._follow("servo_j", servo, shaped)

    def move_joints(self, qd: Floats, acceleration: float, *, shaped: bool) -> int:
        """Approach velocities of the joints, see `JointSpeed`; return the motion's number.

        Raises:
            RefusalError: See `servo`.
        """
        self._check("speed_j", shaped)
        speed, most = self._present(JointSpeed, shaped), self._most(shaped)
        if speed is None:
            rate = self._motion.motions.speed
            speed = JointSpeed(self._start(shaped), most, self._torque, PERIOD, rate=rate)
        if shaped:
            qd = qd * min(1.0, most.velocity / max(float(np.abs(qd).max()), most.velocity))
        speed.aim(qd, acceleration)
        return self._follow("speed_j", speed, shaped)

    def move_tool(
        self, twist: Floats, acceleration: float, angular_acceleration: float, *, shaped: bool
    ) -> int:
        """Approach a velocity of the tool, see `ToolSpeed`; return the motion's number.

        Raises:
            RefusalError: See `servo`.
        """
        self._check("speed_l", shaped)
        speed, tool = self._present(ToolSpeed, shaped), self._tool
        if speed is None or speed.kinematics is not tool:
            rate = self._motion.motions.speed
            speed = ToolSpeed(self._start(shaped), self._most(shaped), tool, self._torque, PERIOD, rate=rate)
        speed.aim(twist, acceleration, angular_acceleration)
        return self._follow("speed_l", speed, shaped)

    def stop_joints(self, acceleration: float | None, trigger: str = "stop_j") -> None:
        """Come to rest with a deceleration of the joints; a guided motion with all of them in phase.

        Args:
            acceleration: Deceleration of the fastest joint [rad/s^2]; None for what the torque permits.
            trigger: Trigger of the table of transitions.
        """
        motion = self._motion
        if motion.activity is not Activity.GUIDED or acceleration is None:
            motion.end(trigger, f"{trigger} was commanded", deceleration=acceleration)
            return
        acceleration = min(max(acceleration, GENTLEST_STOP), self._limits.acceleration)
        state = self._start(shaped=False)
        stop = JointSpeed(state, self._limits, self._torque, PERIOD)
        stop.aim(np.zeros_like(state[0]), acceleration)
        stop.acceleration = acceleration
        self._halt(trigger, stop, stop.duration)

    def stop_tool(self, acceleration: float, angular_acceleration: float) -> None:
        """Come to rest with a deceleration of the tool, which goes on straight if `speed_l` moves it.

        Other motions brake with the deceleration of the joints that corresponds to it at their present velocities.

        Args:
            acceleration: Deceleration [m/s^2].
            angular_acceleration: Angular deceleration [rad/s^2].
        """
        cycle = self._cycle
        state, present, tool = cycle.line.shaped.newest, cycle.trajectory, self._tool
        fastest, twist = float(np.abs(state.qd).max()), tool.jacobian(state.q) @ state.qd
        duration = max(
            float(np.linalg.norm(twist[:3])) / acceleration,
            float(np.linalg.norm(twist[3:])) / angular_acceleration,
        )
        straight = self._motion.activity is Activity.GUIDED and isinstance(present, ToolSpeed)
        if not straight or duration == 0.0:
            self.stop_joints(fastest / duration if duration > 0.0 else None, "stop_l")
            return
        harder = max(duration * GENTLEST_STOP / fastest, 1.0)
        stop = ToolSpeed(self._start(shaped=False), self._limits, tool, self._torque, PERIOD)
        stop.aim(np.zeros(6), harder * acceleration, harder * angular_acceleration)
        stop.acceleration = harder * fastest / duration
        self._halt("stop_l", stop, stop.duration)

    @property
    def _tool(self) -> ToolKinematics:
        """Kinematics of the present tool centre point."""
        if self._motion.tcp != self._tcp:
            self._tcp = self._motion.tcp
            self._kinematics = self._kinematics.with_tool(self._tcp)
        return self._kinematics

    def _most(self, shaped: bool) -> MotionLimits:
        """Limits of a reference."""
        return self._cycle.line.filter.spared(self._limits) if shaped else self._limits

    def _check(self, trigger: str, shaped: bool) -> None:
        """Refuse a command that the present activity does not allow."""
        self._motion.check(trigger)
        if shaped and self._motion.activity is not Activity.REST and not self._continues(shaped):
            why = "shaped is true; it must be false, since this motion does not begin at rest"
            raise RefusalError("busy", "shaped", why)

    def _continues(self, shaped: bool) -> bool:
        """Return whether a command continues the reference of the one before."""
        return self._motion.activity is Activity.GUIDED and shaped == self._cycle.mode.shaped

    def _present(self, kind: type[G], shaped: bool) -> G | None:
        """Return the present trajectory, if it is of this kind and continues."""
        present = self._cycle.trajectory
        return present if self._continues(shaped) and isinstance(present, kind) else None

    def _start(self, shaped: bool) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration from which a trajectory begins."""
        cycle, present = self._cycle, self._cycle.trajectory
        if self._continues(shaped) and isinstance(present, Guided):
            return present.state
        if cycle.mode.at_rest:
            q = cycle.sample.reference if shaped else cycle.line.shaped.position
            return q, np.zeros_like(q), np.zeros_like(q)
        newest = cycle.line.shaped.newest
        return newest.q, newest.qd, newest.qdd

    def _follow(self, trigger: str, trajectory: Guided, shaped: bool) -> int:
        """Carry out the transition; return the motion's number."""
        motion, cycle = self._motion, self._cycle
        guard = None
        if motion.activity is not Activity.GUIDED:
            guard = motion.ahead.guard_of_guided()
            motion.motions.stopped(f"{trigger} took over", None)
        if not shaped:
            cycle.begin(trajectory, LineMode.BYPASSED, guard)
        elif trajectory is not cycle.trajectory:
            if cycle.mode.at_rest:
                cycle.line.filter.tvist.aim(None)
            cycle.begin(trajectory, LineMode.GUARDED, guard)
        motion.go(trigger)
        return motion.motions.guide(trajectory)

    def _halt(self, trigger: str, stop: Guided, duration: float) -> None:
        """End the guided motion by a trajectory that comes to rest in some time [s]."""
        motion, fastest = self._motion, float(np.abs(stop.state[1]).max())
        self._cycle.begin(stop, LineMode.BYPASSED)
        motion.go(trigger)
        why, way = f"{trigger} was commanded", 0.5 * duration * fastest
        motion.motions.stopped(why, None, category=2, duration=duration, way=way)

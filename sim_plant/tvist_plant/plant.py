"""The arm: drive commands in, measurements out, one control period at a time. No clock, no I/O."""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tvist_plant._compiled import is_cached
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand, LinearPart, Nonlinear
from tvist_plant.integrator import advance, balance
from tvist_plant.model import FlexibleModel, Floats, flexible_model
from tvist_plant.modes import Modes, modes
from tvist_plant.sensors import Accelerometer, Encoders, gear_phases

PERIOD = 0.002
"""Control period [s]."""
SUBSTEPS = 4
"""Substeps in it. From Q1 to Q3 four agree with eight within 0.02 m/s² of tool acceleration, two within 0.09;
most of that is the ripple of the gears."""


def is_compiled() -> bool:
    """Whether the arm's equations are compiled already; otherwise the first tick does it, for seconds."""
    return is_cached(advance) and is_cached(balance)


class PlantError(ArithmeticError):
    """The arm's state is no longer finite: it was driven beyond what the physics is good for."""


@dataclass(slots=True, eq=False)
class Measurement:
    """What a robot can measure of itself.

    Not frozen: one is made every tick, and that would cost five times as much.
    """

    q: Floats
    """Link-side joint angles, shape (n,) [rad]."""
    qd: Floats
    """Link-side joint velocities, shape (n,) [rad/s]."""
    moment: Floats
    """Motor torques on the joint side, shape (n,) [N m]."""
    accelerometer: Floats
    """Specific force in the flange frame, with noise, shape (3,) [m/s^2]."""


@dataclass(frozen=True)
class Truth:
    """What no robot can know."""

    motor_q: Floats
    """Motor angles on the joint side θ, shape (n,) [rad]."""
    motor_qd: Floats
    """[rad/s]."""
    gear_deflection: Floats
    """q - θ, shape (n,) [rad]."""
    link_deflection: Floats
    """Angles of the virtual joints of bending links [rad]."""
    flange_position: Floats
    """Of the flexible arm, shape (3,) [m]."""
    flange_rotation: Floats
    """Of the flexible arm, shape (3, 3)."""
    specific_force: Floats
    """In the flange frame, without noise, shape (3,) [m/s^2]."""


class Plant:
    """A flexible arm and its drives.

    Args:
        description: The robot.
        payload: What it carries.
        period: Control period [s].
        substeps: Of the integrator in a period.
    """

    def __init__(
        self,
        description: RobotDescription,
        payload: Payload,
        *,
        period: float = PERIOD,
        substeps: int = SUBSTEPS,
    ) -> None:
        self.description = description
        self.period = period
        self._substeps = substeps
        self._nonlinear = Nonlinear.of(description.drives)
        self._load(payload)
        n = description.joints
        self._phase = np.zeros(n)
        self._accelerometer = Accelerometer(description.sensors.accelerometer_noise, 0)
        self._encoders = Encoders(description.sensors.encoder_step)
        self._command = np.zeros((3, n))
        self._external: Floats | None = None

    def _load(self, payload: Payload) -> None:
        """Models of the arm with this payload, and room for its state."""
        self.payload = payload
        self._flexible: FlexibleModel = self._build(payload)
        self._data: pin.Data = self._flexible.model.createData()
        self._gravity: Floats = np.array(self._flexible.model.gravity.linear)
        self._linear = LinearPart.of(self._flexible, self.description.drives)
        self._links = self._flexible.model.nv
        size = self._links + self.description.joints
        self._y, self._v, self._a = np.zeros((3, size))
        self._s = np.zeros(self.description.joints)
        self._q, self._qd, self._motor, self._speed = (
            self._y[: self._links], self._v[: self._links], self._y[self._links :], self._v[self._links :]
        )  # fmt: skip
        self._bias, self._qdd = np.zeros((2, self._links))
        self._last_M, self._last_bias = self._data.M.copy(), self._bias
        self._moment = np.zeros(self.description.joints)
        self._work_matrix, self._work = np.zeros((size, size)), np.zeros(size)

    def _build(self, payload: Payload) -> FlexibleModel:
        """The arm with a payload; another arm is another one of these."""
        return flexible_model(self.description, payload)

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest in static equilibrium under a command, integrators preloaded, noise restarted.

        Args:
            command: Position to hold and torque fed forward; its velocity must be zero.
            payload: What the arm carries from now on; None leaves it.
            seed: Of sensor noise and gear errors.
        """
        if payload is not None:
            self._load(payload)
        self._external = None
        self._phase = gear_phases(self.description.joints, seed)
        self._accelerometer = Accelerometer(self.description.sensors.accelerometer_noise, seed)
        self._encoders = Encoders(self.description.sensors.encoder_step)
        self._command = np.array([command.q, command.qd, command.torque])
        self._settle(command)
        return self._measure()

    def _settle(self, command: DriveCommand) -> None:
        """Static equilibrium by fixed point: deflections are small, so gravity hardly depends on them."""
        joints, flexes, nonlinear = self._flexible.joints, self._flexible.flexes, self._nonlinear
        q = np.zeros(self._links)
        q[joints] = command.q
        error = nonlinear.gear_error * np.sin(nonlinear.gear_waves * command.q + self._phase)
        for _ in range(50):
            gravity = pin.computeGeneralizedGravity(self._flexible.model, self._data, q)
            new = np.zeros(self._links)
            new[joints] = command.q + error - gravity[joints] / nonlinear.gear_stiffness
            new[flexes] = -gravity[flexes] / self._flexible.flex_stiffness
            moved = np.max(np.abs(new - q))
            q = new
            if moved < 1e-15:
                break
        self._q[:], self._motor[:] = q, command.q
        self._v[:], self._a[:] = 0.0, 0.0
        wanted = gravity[joints] - command.torque
        gain = self._linear.integral_gain
        self._s = np.divide(wanted, gain, out=np.zeros_like(wanted), where=gain > 0.0)
        self._evaluate()
        self._last_M, self._last_bias = self._data.M.copy(), self._bias

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one period, its drives going linearly from the last command to this one.

        Raises:
            PlantError: The state is no longer finite.
        """
        linear, nonlinear = self._linear, self._nonlinear
        start, end = self._command, np.array([command.q, command.qd, command.torque])
        advance(
            self._y, self._v, self._s, self._a,
            self._data.M, self._bias, self._last_M, self._last_bias,
            start, end, self._flexible.joints,
            linear.stiffness, linear.damping, linear.rotor_inertia,
            linear.velocity_gain, linear.position_gain, linear.integral_gain,
            nonlinear.friction, nonlinear.friction_width,
            nonlinear.gear_stiffness, nonlinear.gear_error, nonlinear.gear_waves, self._phase,
            self.period, self._substeps, self._work_matrix, self._work,
        )  # fmt: skip
        self._command = end
        self._last_M, self._last_bias = self._data.M.copy(), self._bias
        self._evaluate()
        return self._measure()

    def push(self, torque: Floats) -> None:
        """Let something outside push the joints from now on, until it is changed or the arm is reset.

        Args:
            torque: On the link side, shape (n,) [N m].
        """
        self._external = torque.copy() if torque.any() else None

    def spoil(self) -> None:
        """Make the state not a number, as a fault: the next step finds it."""
        self._speed[:] = math.nan

    def _evaluate(self) -> None:
        """Mass matrix, bias, link accelerations and motor torques at the present state."""
        model, data, linear, nonlinear = self._flexible.model, self._data, self._linear, self._nonlinear
        pin.crba(model, data, self._q)
        self._bias = pin.nonLinearEffects(model, data, self._q, self._qd).copy()
        if self._external is not None:
            self._bias[self._flexible.joints] -= self._external
        balance(
            self._y, self._v, self._s, data.M, self._bias, self._command, self._flexible.joints,
            linear.stiffness, linear.damping,
            linear.velocity_gain, linear.position_gain, linear.integral_gain,
            nonlinear.gear_stiffness, nonlinear.gear_error, nonlinear.gear_waves, self._phase,
            self._work_matrix, self._qdd, self._moment,
        )  # fmt: skip
        if not math.isfinite(self._qdd.dot(self._qdd)):
            raise PlantError("the arm's state is no longer finite")

    def _measure(self) -> Measurement:
        joints = self._flexible.joints
        self._specific_force = self._feel()
        return Measurement(
            q=self._encoders.read(self._q[joints]),
            qd=self._qd[joints],
            moment=self._moment.copy(),
            accelerometer=self._accelerometer.read(self._specific_force),
        )

    def _feel(self) -> Floats:
        """Specific force in the flange frame, shape (3,) [m/s^2]."""
        model, data, flange = self._flexible.model, self._data, self._flexible.flange
        pin.forwardKinematics(model, data, self._q, self._qd, self._qdd)
        placement = pin.updateFramePlacement(model, data, flange)
        acceleration = pin.getFrameClassicalAcceleration(model, data, flange, pin.LOCAL).linear
        return np.asarray(acceleration - self._gravity.dot(placement.rotation))

    def truth(self) -> Truth:
        """What no robot can know, at the present state."""
        placement = self._data.oMf[self._flexible.flange]
        joints = self._flexible.joints
        return Truth(
            motor_q=self._motor.copy(),
            motor_qd=self._speed.copy(),
            gear_deflection=self._q[joints] - self._motor,
            link_deflection=self._q[self._flexible.flexes],
            flange_position=placement.translation.copy(),
            flange_rotation=placement.rotation.copy(),
            specific_force=self._specific_force,
        )

    def modes(self, q: Floats | None = None) -> Modes:
        """Vibration modes of the closed loop, linearised at rest at joint positions q (default: its own)."""
        links = self._q.copy()
        if q is not None:
            links[:] = 0.0
            links[self._flexible.joints] = q
        return modes(self._flexible, self._linear, self.description, links)

    def energy(self) -> float:
        """Kinetic, gravitational and elastic energy without the drives' gains [J]; checks the integrator."""
        model, data = self._flexible.model, self._data
        kinetic = pin.computeKineticEnergy(model, data, self._q, self._qd)
        rotors = 0.5 * self._linear.rotor_inertia @ self._speed**2
        gears = 0.5 * self._nonlinear.gear_stiffness @ (self._q[self._flexible.joints] - self._motor) ** 2
        links = 0.5 * self._flexible.flex_stiffness @ self._q[self._flexible.flexes] ** 2
        return float(kinetic + pin.computePotentialEnergy(model, data, self._q) + rotors + gears + links)

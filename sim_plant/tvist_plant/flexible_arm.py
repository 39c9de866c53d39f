"""The simulated arm with elastic joints and links, without clock or I/O."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import msgspec
import numpy as np
import pinocchio as pin

from tvist_plant.arm_memory import ENCODER_STEP, GRAVITY, LAST, NOW, SUBSTEPS, memory_for, parts
from tvist_plant.arm_memory import PERIOD as PERIOD_AT
from tvist_plant.arm_tick import evaluate, move, play, tick
from tvist_plant.chain import BODY, body_of, chain_of
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import (
    DriveCommand,
    gear_error,
    joint_parameters,
    springs_and_dampers,
    static_twist,
)
from tvist_plant.external_forces import ExternalForces
from tvist_plant.imperfections import STICTION, Imperfections, imperfect_model
from tvist_plant.integrator import rows
from tvist_plant.model import FlexibleModel, Floats
from tvist_plant.modes import Modes, modes
from tvist_plant.plant import PERIOD, Measurement, PlantError, PlantTruth, Response, SimulatedArm
from tvist_plant.robot_checks import in_words
from tvist_plant.sensors import Accelerometer, gear_phases

SUBSTEPS_OF_A_PERIOD = 4
"""Substeps per period. Over moves Q1 to Q3, four agree with eight within 0.02 m/s² of tool acceleration,
mostly gear ripple; two agree within 0.09."""
SUBSTEPS_IF_IMPERFECT = 8
"""Substeps with imperfections, which are integrated explicitly. Stiction alone needs only four: the flange's
acceleration is then within 0.02 m/s² of that with 64."""


def combined(description: RobotDescription, more: Imperfections | None) -> Imperfections:
    """Return the robot file's imperfections, overridden by values of `more`; raise ValueError if one is invalid."""
    if more is None:
        return description.imperfections
    given = more.given()
    content = msgspec.to_builtins(given)
    try:
        msgspec.convert(content, Imperfections)
    except msgspec.ValidationError as error:
        raise ValueError(in_words(error, content)) from None
    return msgspec.structs.replace(description.imperfections, **given)


class FlexibleArm(SimulatedArm):
    """A flexible arm and its drives: a `Plant` with pushes, payload changes, a fault and vibration modes.

    `imperfections` override the robot file's. `carries` maps each declared payload to the one truly carried.
    """

    def __init__(
        self,
        description: RobotDescription,
        payload: Payload,
        *,
        imperfections: Imperfections | None = None,
        period: float = PERIOD,
        substeps: int | None = None,
        carries: Callable[[Payload], Payload] | None = None,
    ) -> None:
        self.description = description
        self.period = period
        more = description.imperfections.given().keys() - STICTION
        usual = SUBSTEPS_IF_IMPERFECT if more else SUBSTEPS_OF_A_PERIOD
        self._substeps = usual if substeps is None else substeps
        self._imperfections = combined(description, imperfections)
        n = description.joints
        self._width = 3 * n + 3
        self._places = slice(n), slice(n, 2 * n), slice(2 * n, 3 * n), slice(3 * n, None)
        """Slices of what `evaluate` measures: angles, velocities, torques and specific force."""
        self._carries = carries or (lambda declared: declared)
        self._load(payload)
        self._accelerometer = Accelerometer(description.sensors.accelerometer_noise, 0)

    def _load(self, payload: Payload) -> None:
        """Build the models with this payload, and memory for the state."""
        self.payload, carried = payload, self._carries(payload)
        self._flexible: FlexibleModel = imperfect_model(self.description, carried, self._imperfections)
        self._external = ExternalForces(self._flexible)
        self.bodies = self._external.bodies
        """Names of the bodies for `push_body`, from the base outwards.

        A link is named after its joint, the outer half of a bending link after its virtual joint about z, the
        last body "flange".
        """
        self._data: pin.Data = self._flexible.model.createData()
        joints = joint_parameters(self.description, self._imperfections, self._flexible.joints)
        self._joints, drives = joints, self.description.drives
        links, n = self._flexible.model.nv, self.description.joints
        self.memory = memory_for(links, n)  # memory of the kernels in `arm_tick`; see `arm_memory`
        self.memory[[PERIOD_AT, SUBSTEPS]] = self.period, self._substeps
        self.memory[GRAVITY] = -self._flexible.model.gravity.linear[2]
        self.memory[ENCODER_STEP] = self.description.sensors.encoder_step
        arm = parts(self.memory)
        arm.chain[:] = chain_of(self._flexible.model, self._flexible.flange)
        arm.springs[:] = [np.diag(one) for one in springs_and_dampers(self._flexible, joints, drives)]
        arm.joints[:] = joints
        y, v, _, self._s, *_ = rows(arm.state, n)
        self._q, self._qd, self._motor, self._speed = y[:links], v[:links], y[links:], v[links:]
        self._arm = arm

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest in static equilibrium under a command at zero velocity."""
        if payload is not None:
            self._load(payload)
        self._external.clear()
        self._joints = self._joints._replace(gear_phase=gear_phases(self.description.joints, seed))
        self._arm.joints[:] = self._joints
        self._accelerometer = Accelerometer(self.description.sensors.accelerometer_noise, seed)
        self._arm.commands[:] = command.q, command.qd, command.torque
        self._arm.readings[:], self._arm.pushed[:] = math.nan, 0.0
        self._settle(command)
        measured = self._evaluate()
        self._arm.dynamics[LAST] = self._arm.dynamics[NOW]
        return measured

    def _settle(self, command: DriveCommand) -> None:
        """Find static equilibrium by fixed-point iteration; gravity varies little with the deflections."""
        joints, flexes = self._flexible.joints, self._flexible.flexes
        q = np.zeros_like(self._q)
        q[joints] = command.q
        error = gear_error(self._joints, command.q)
        for _ in range(50):
            gravity = pin.computeGeneralizedGravity(self._flexible.model, self._data, q)
            new = np.zeros_like(q)
            new[joints] = command.q + error - static_twist(self._joints, gravity[joints])
            new[flexes] = -gravity[flexes] / self._flexible.flex_stiffness
            moved = np.max(np.abs(new - q))
            q = new
            if moved < 1e-15:
                break
        self._arm.state[:] = 0.0
        self._q[:], self._motor[:] = q, command.q
        wanted = gravity[joints] - command.torque
        gain = self._joints.integral_gain
        self._s[:] = np.divide(wanted, gain, out=np.zeros_like(wanted), where=gain > 0.0)

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by a period, in which drives' commands change linearly from the last to this one."""
        if self._external.rests:
            out = np.empty(self._width)
            finite = tick(self.memory, command.q, command.qd, command.torque, out)
            return self._measured(out, finite)
        move(self.memory, command.q, command.qd, command.torque)
        self._arm.pushed[:] = self._external.generalized_force(self._q)
        measured = self._evaluate()
        self._arm.pushed[:] = 0.0
        return measured

    def play(self, commands: Floats) -> Response:
        """Move the arm by many periods in one call."""
        if not self._external.rests:
            return super().play(commands)
        response = self._played(self.memory, commands)
        force = response.specific_force
        noisy = self._accelerometer.read_all(force)
        if len(force):
            self._specific_force = force[-1]
        return replace(response, measured=replace(response.measured, accelerometer=noisy))

    def held(self) -> Callable[[int], Response]:
        """Save the state; return a function that computes the response if drives hold the last position."""
        memory = self.memory.copy()
        command = parts(memory).commands[NOW].copy()
        command[1] = 0.0
        return lambda periods: self._played(memory.copy(), np.tile(command, (periods, 1, 1)))

    @staticmethod
    def _played(memory: Floats, commands: Floats) -> Response:
        """Compute periods without external forces or accelerometer noise."""
        T, n = len(commands), commands.shape[2]
        out, flange = np.empty((T, 3 * n + 3)), np.empty((T, 12))
        if play(memory, np.ascontiguousarray(commands, dtype=float), out, flange) < T:
            raise PlantError("the arm's state is no longer finite")
        force = out[:, 3 * n :]
        measured = Measurement(out[:, :n], out[:, n : 2 * n], out[:, 2 * n : 3 * n], force)
        return Response(measured, force, flange[:, 9:], flange[:, :9].reshape(T, 3, 3))

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on."""
        self.payload, model = payload, self._flexible.model
        self._flexible.carry(self._carries(payload))
        self._arm.chain[model.nv - 1, BODY:] = body_of(model, model.nv)
        self._arm.pushed[:] = 0.0 if self._external.rests else self._external.generalized_force(self._q)
        evaluate(self.memory, np.empty(self._width))
        self._arm.pushed[:] = 0.0
        # The integrator extrapolates from the last two ticks, but their difference is a jump, not a trend.
        self._arm.dynamics[LAST] = self._arm.dynamics[NOW]

    def push(self, torque: Floats) -> None:
        """Apply external link-side torques (n,) [N m] until changed or reset; raise ValueError if invalid."""
        self._external.push(torque)

    def push_body(
        self,
        body: str,
        force: Sequence[float] = (0.0, 0.0, 0.0),
        moment: Sequence[float] = (0.0, 0.0, 0.0),
        point: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Apply a force [N] and a moment about the point [N m] to one of `bodies` until changed or reset.

        The wrench replaces the previous one on this body, and adds to those on other bodies and to `push`;
        zeros end it. It is in world axes and does not turn with the body. The point [m] is in the body's
        frame, which is that of its joint or the flange. Raise ValueError for an unknown body or anything but
        three finite numbers.
        """
        self._external.push_body(body, force, moment, point)

    def make_nan(self) -> None:
        """Make the state NaN, a fault that the next step detects."""
        self._speed[:] = math.nan

    def _evaluate(self) -> Measurement:
        out = np.empty(self._width)
        return self._measured(out, evaluate(self.memory, out))

    def _measured(self, out: Floats, finite: bool) -> Measurement:
        if not finite:
            raise PlantError("the arm's state is no longer finite")
        q, qd, moment, force = self._places
        self._specific_force = out[force]
        return Measurement(out[q], out[qd], out[moment], self._accelerometer.read(self._specific_force))

    def truth(self) -> PlantTruth:
        """Return the present values that a real robot cannot measure."""
        flexible, flange = self._flexible, self._arm.bodies[-1]
        joints, flexes = flexible.joints, flexible.flexes
        gravity = pin.computeGeneralizedGravity(flexible.model, self._data, self._q)
        sag = np.zeros_like(gravity)  # deflections that remain at rest in this posture [rad]
        sag[joints] = gear_error(self._joints, self._motor) - static_twist(self._joints, gravity[joints])
        sag[flexes] = -gravity[flexes] / flexible.flex_stiffness
        return PlantTruth(
            motor_q=self._motor.copy(),
            motor_qd=self._speed.copy(),
            gear_deflection=self._q[joints] - self._motor,
            link_deflection=self._q[flexible.bending],
            flange_position=flange[9:12].copy(),
            flange_rotation=flange[:9].reshape(3, 3).copy(),
            specific_force=self._specific_force,
            static_gear_deflection=sag[joints],
            static_link_deflection=sag[flexible.bending],
        )

    def modes(self, q: Floats | None = None) -> Modes:
        """Return the closed loop's modes, linearised at rest at joint positions q (default: present ones)."""
        links = self._q.copy()
        if q is not None:
            links[:] = 0.0
            links[self._flexible.joints] = q
        return modes(self._flexible, self._joints, self.description, links)

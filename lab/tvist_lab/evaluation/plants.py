"""Arms that are not quite what their description says: what a shaper meets outside its own model.

`VariantPlant` adds to the plant what its equations lack: friction that falls with speed (Stribeck), gears with
hysteresis, gears that stiffen with torque, and a base that yields. With none of these it is the plant.

Friction on a motor turning at v (Canudas de Wit and others 1995, without the bristles):

    F(v) = [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w)

A gear twisted by δ pushes with

    K δ                                   as described,
    K₁ δ up to |δ| = δ₁, K beyond it      piecewise (makers of strain wave gears give K₁ < K),
    K δ + z                               with hysteresis, ż = r K δ̇ - |δ̇| z r K/z_max  (Dahl 1968).

A base that yields stands on two springs about the world's x and y axes, and below it a ring of some mass.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tvist_lab.recordings import Floats
from tvist_lab.second_opinion import SecondOpinion
from tvist_plant._compiled import compiled
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.integrator import balance, cholesky, solve
from tvist_plant.model import FLANGE, FlexibleModel, Integers, flexible_model
from tvist_plant.plant import Measurement, Plant, PlantError

SUBSTEPS = 8
"""Of the integrator in a period: what is added is explicit in it."""
TIMESTEP = 0.00025
"""Of MuJoCo [s]."""


@dataclass(frozen=True)
class Yields:
    """A base on springs."""

    stiffness: float = 1.5e5
    """About each of the two axes [N m/rad]."""
    damping_time: float = 1e-3
    """Damping over stiffness [s]."""
    mass: float = 20.0
    """Of the ring under the arm [kg]."""
    radius: float = 0.25
    """Of its inertia [m]."""


@dataclass(frozen=True)
class Variant:
    """What an arm has that its description does not say."""

    breakaway: float = 1.0
    """F_s over F_c [-]."""
    stribeck_speed: float = 0.05
    """v_s [rad/s]."""
    hysteresis: float = 0.0
    """r: stiffness that a gear has more when its twist turns back [-]."""
    hysteresis_torque: float = 0.02
    """z_max over the joint's torque limit [-]."""
    soft: float = 1.0
    """K₁ over K [-]."""
    soft_torque: float = 0.1
    """K₁ δ₁ over the joint's torque limit [-]."""
    base: Yields | None = None
    """None: the base is rigid."""


@compiled
def relaxed(z: float, twist: float, stiffness: float, most: float) -> float:
    """Dahl's friction force z after a further twist in one direction: the exact solution of its equation."""
    end = most if twist > 0.0 else -most
    return end + (z - end) * math.exp(-stiffness * abs(twist) / most)


@compiled
def advance_variant(  # noqa: C901, PLR0912 - one kernel, as the plant's
    y: Floats,
    v: Floats,
    s: Floats,
    a: Floats,
    z: Floats,
    M: Floats,
    bias: Floats,
    last_M: Floats,
    last_bias: Floats,
    start: Floats,
    end: Floats,
    joints: Integers,
    stiffness: Floats,
    damping: Floats,
    rotor_inertia: Floats,
    velocity_gain: Floats,
    position_gain: Floats,
    integral_gain: Floats,
    friction: Floats,
    friction_width: float,
    breakaway: float,
    stribeck_speed: float,
    gear_stiffness: Floats,
    gear_error: float,
    gear_waves: float,
    gear_phase: Floats,
    softness: Floats,
    soft_angle: Floats,
    hysteresis: Floats,
    hysteresis_torque: Floats,
    period: float,
    substeps: int,
    S: Floats,
    f: Floats,
) -> None:
    """Move the state by one period, in place, as `tvist_plant.integrator.advance`.

    Args:
        y: As there; so are those not named here.
        v: See above.
        s: See above.
        a: See above.
        z: Torque of each gear's hysteresis, in and out, shape (n,) [N m].
        M: See above.
        bias: See above.
        last_M: See above.
        last_bias: See above.
        start: See above.
        end: See above.
        joints: See above.
        stiffness: See above.
        damping: See above.
        rotor_inertia: See above.
        velocity_gain: See above.
        position_gain: See above.
        integral_gain: See above.
        friction: See above.
        friction_width: See above.
        breakaway: F_s/F_c [-].
        stribeck_speed: v_s [rad/s].
        gear_stiffness: See above.
        gear_error: See above.
        gear_waves: See above.
        gear_phase: See above.
        softness: K - K₁, shape (n,) [N m/rad].
        soft_angle: δ₁, shape (n,) [rad].
        hysteresis: r K, shape (n,) [N m/rad].
        hysteresis_torque: z_max, shape (n,) [N m].
        period: See above.
        substeps: See above.
        S: See above.
        f: See above.
    """
    size, links, n = y.shape[0], M.shape[0], s.shape[0]
    h = period / substeps
    for i in range(size):
        for j in range(i + 1):
            S[i, j] = 0.5 * h * damping[i, j] + 0.25 * h * h * stiffness[i, j]
    for i in range(links):
        for j in range(i + 1):
            S[i, j] += 1.5 * M[j, i] - 0.5 * last_M[j, i]
    for j in range(n):
        S[links + j, links + j] += rotor_inertia[j] + 0.125 * h * h * h * integral_gain[j]
    cholesky(S)

    for step in range(substeps):
        middle = (step + 0.5) / substeps
        for i in range(links):
            f[i] = -bias[i] - middle * (bias[i] - last_bias[i])
        for j in range(n):
            m, l = links + j, joints[j]
            q_r = start[0, j] + middle * (end[0, j] - start[0, j])
            qd_r = start[1, j] + middle * (end[1, j] - start[1, j])
            torque = start[2, j] + middle * (end[2, j] - start[2, j])
            speed = v[m] + 0.5 * h * a[m]
            angle = y[m] + 0.5 * h * speed
            rise = 1.0 + (breakaway - 1.0) * np.exp(-((speed / stribeck_speed) ** 2))
            slack = friction[j] * (speed / friction_width - rise * np.tanh(speed / friction_width))
            error = gear_error * np.sin(gear_waves * angle + gear_phase[j])
            wave = gear_stiffness[j] * error
            twisting = v[l] + 0.5 * h * a[l] - speed
            twist = y[l] - y[m] + 0.5 * h * twisting - error
            more = -softness[j] * min(max(twist, -soft_angle[j]), soft_angle[j])
            if hysteresis[j] > 0.0:
                more += relaxed(z[j], 0.5 * h * twisting, hysteresis[j], hysteresis_torque[j])
            f[m] = torque + velocity_gain[j] * qd_r + position_gain[j] * q_r + slack - wave
            f[m] += integral_gain[j] * (s[j] + 0.5 * h * q_r) + more
            f[l] += wave - more
        for i in range(size):
            value = f[i]
            for j in range(size):
                value -= damping[i, j] * v[j] + stiffness[i, j] * (y[j] + 0.5 * h * v[j])
            a[i] = value
        for j in range(n):
            m = links + j
            a[m] -= 0.5 * h * integral_gain[j] * (y[m] + 0.5 * h * v[m])
        solve(S, a)
        for j in range(n):
            m, l = links + j, joints[j]
            q_r = start[0, j] + middle * (end[0, j] - start[0, j])
            s[j] += h * (q_r - (y[m] + 0.5 * h * (v[m] + 0.5 * h * a[m])))
            if hysteresis[j] > 0.0:
                twisted = h * (v[l] - v[m] + 0.5 * h * (a[l] - a[m]))
                z[j] = relaxed(z[j], twisted, hysteresis[j], hysteresis_torque[j])
        for i in range(size):
            y[i] += h * (v[i] + 0.5 * h * a[i])
            v[i] += h * a[i]


class VariantPlant(Plant):
    """The plant with what a variant adds.

    Args:
        description: The arm, as far as it can say.
        payload: What it carries.
        variant: What it cannot say.
        substeps: Of the integrator in a period.
    """

    def __init__(
        self, description: RobotDescription, payload: Payload, variant: Variant, *, substeps: int = SUBSTEPS
    ) -> None:
        self._variant = variant
        limit = np.array(description.limits.torque)
        K = np.array(description.drives.gear_stiffness)
        self._softness = (1.0 - variant.soft) * K
        self._soft_angle = variant.soft_torque * limit / (variant.soft * K)
        self._hysteresis = variant.hysteresis * K
        self._hysteresis_torque = variant.hysteresis_torque * limit
        self._z = np.zeros(description.joints)
        super().__init__(description, payload, substeps=substeps)

    def _build(self, payload: Payload) -> FlexibleModel:
        arm = flexible_model(self.description, payload)
        return arm if self._variant.base is None else on_base(arm, self._variant.base)

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one period; see `Plant.step`."""
        linear, nonlinear, variant = self._linear, self._nonlinear, self._variant
        start, end = self._command, np.array([command.q, command.qd, command.torque])
        advance_variant(
            self._y, self._v, self._s, self._a, self._z,
            self._data.M, self._bias, self._last_M, self._last_bias,
            start, end, self._flexible.joints,
            linear.stiffness, linear.damping, linear.rotor_inertia,
            linear.velocity_gain, linear.position_gain, linear.integral_gain,
            nonlinear.friction, nonlinear.friction_width, variant.breakaway, variant.stribeck_speed,
            nonlinear.gear_stiffness, nonlinear.gear_error, nonlinear.gear_waves, self._phase,
            self._softness, self._soft_angle, self._hysteresis, self._hysteresis_torque,
            self.period, self._substeps, self._work_matrix, self._work,
        )  # fmt: skip
        self._command = end
        self._last_M, self._last_bias = self._data.M.copy(), self._bias
        self._evaluate()
        return self._measure()

    def gear_torque(self) -> Floats:
        """What each gear pushes with beyond K δ, at the present state, shape (n,) [N m]."""
        nonlinear = self._nonlinear
        error = nonlinear.gear_error * np.sin(nonlinear.gear_waves * self._motor + self._phase)
        twist = self._q[self._flexible.joints] - self._motor - error
        return np.asarray(self._z - self._softness * np.clip(twist, -self._soft_angle, self._soft_angle))

    def _settle(self, command: DriveCommand) -> None:
        """Static equilibrium, without hysteresis in the gears; a soft gear twists further."""
        self._z[:] = 0.0
        super()._settle(command)
        joints = self._flexible.joints
        nonlinear = self._nonlinear
        error = nonlinear.gear_error * np.sin(nonlinear.gear_waves * command.q + self._phase)
        for _ in range(50):
            gravity = pin.computeGeneralizedGravity(self._flexible.model, self._data, self._q)
            last = self._q.copy()
            soft = nonlinear.gear_stiffness - self._softness
            beyond = np.maximum(np.abs(gravity[joints]) - soft * self._soft_angle, 0.0)
            within = np.minimum(np.abs(gravity[joints]) / soft, self._soft_angle)
            twist = within + beyond / nonlinear.gear_stiffness
            self._q[joints] = command.q + error - np.sign(gravity[joints]) * twist
            self._q[self._flexible.flexes] = -gravity[self._flexible.flexes] / self._flexible.flex_stiffness
            if np.max(np.abs(self._q - last)) < 1e-15:
                break
        gain = self._linear.integral_gain
        wanted = gravity[joints] - command.torque
        self._s = np.divide(wanted, gain, out=np.zeros_like(wanted), where=gain > 0.0)
        self._evaluate()
        self._last_M, self._last_bias = self._data.M.copy(), self._bias

    def _evaluate(self) -> None:
        model, data, linear, nonlinear = self._flexible.model, self._data, self._linear, self._nonlinear
        pin.crba(model, data, self._q)
        self._bias = pin.nonLinearEffects(model, data, self._q, self._qd).copy()
        felt = self._bias.copy()
        felt[self._flexible.joints] += self.gear_torque()
        balance(
            self._y, self._v, self._s, data.M, felt, self._command, self._flexible.joints,
            linear.stiffness, linear.damping,
            linear.velocity_gain, linear.position_gain, linear.integral_gain,
            nonlinear.gear_stiffness, nonlinear.gear_error, nonlinear.gear_waves, self._phase,
            self._work_matrix, self._qdd, self._moment,
        )  # fmt: skip
        if not np.isfinite(self._qdd).all():
            raise PlantError("the arm's state is no longer finite")


def on_base(arm: FlexibleModel, base: Yields) -> FlexibleModel:
    """The same arm on a base that yields about the world's x and y axes; both count as virtual joints."""
    ground = pin.Model()
    inertia = pin.Inertia(base.mass, np.zeros(3), base.mass * base.radius**2 * np.eye(3) / 2.0)
    light = pin.Inertia(0.05 * base.mass, np.zeros(3), 0.05 * base.mass * base.radius**2 * np.eye(3) / 2.0)
    first = ground.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "base_x")
    ground.appendBodyToJoint(first, light, pin.SE3.Identity())
    second = ground.addJoint(first, pin.JointModelRY(), pin.SE3.Identity(), "base_y")
    ground.appendBodyToJoint(second, inertia, pin.SE3.Identity())
    foot = ground.addFrame(pin.Frame("foot", second, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    whole = pin.appendModel(ground, arm.model, foot, pin.SE3.Identity())
    place = np.array(
        [whole.idx_vs[whole.getJointId(arm.model.names[j + 1])] for j in range(arm.model.njoints - 1)]
    )
    return FlexibleModel(
        model=whole,
        joints=place[arm.joints],
        flexes=np.concatenate([[0, 1], place[arm.flexes]]).astype(np.int64),
        flex_stiffness=np.concatenate([[base.stiffness] * 2, arm.flex_stiffness]),
        flex_damping=np.concatenate([[base.stiffness * base.damping_time] * 2, arm.flex_damping]),
        flange=whole.getFrameId(FLANGE),
    )


@dataclass(slots=True, eq=False)
class Felt:
    """What the metrics want to know of an arm that is no `Plant`."""

    specific_force: Floats
    """In the flange frame, without noise, shape (3,) [m/s^2]."""
    flange_rotation: Floats
    """Shape (3, 3)."""


class MujocoArm:
    """The arm in MuJoCo, at the end of the same line.

    Args:
        description: The arm.
        payload: What it carries.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._arm = SecondOpinion(description, payload, TIMESTEP)

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> None:  # noqa: ARG002
        """Static equilibrium; it has no noise to begin anew, and carries what it was made with."""
        self._arm.reset(command)

    def step(self, command: DriveCommand) -> Floats:
        """One period."""
        return self._arm.step(command)

    def truth(self) -> Felt:
        """Acceleration and orientation of the flange."""
        force, rotation = self._arm.flange()
        return Felt(force, rotation)

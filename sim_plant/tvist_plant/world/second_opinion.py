"""Verification of the plant: the same arm built in MuJoCo from the same description, independently of our model.

Bodies, virtual joints and lumps are placed by the description's frames; MuJoCo computes the
dynamics and integrates them (semi-implicit Euler with implicit damping, first order). Only the description is shared;
gear errors and sensor noise are left out. Requires the package `mujoco`.
"""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from tvist_kernels.compiling import compiled
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import FLANGE
from tvist_plant.world.arm_form import LOAD, arm_spec, flex_name, joint_name, motor_name, principal

Floats = NDArray[np.float64]

PERIOD = 0.002
"""Time between commands [s]."""


@compiled
def drive(
    start: Floats,
    end: Floats,
    share: float,
    timestep: float,
    motors: NDArray[np.int64],
    laws: Floats,
    s: Floats,
    q: Floats,
    qd: Floats,
    applied: Floats,
) -> None:
    """Compute the torques of the drives for one of MuJoCo's steps.

    Args:
        start: Rows q_r, q̇_r and τ_ff of the last command, shape (3, n).
        end: Those of this one.
        share: Elapsed share of the period [-].
        timestep: MuJoCo's step [s].
        motors: Indices of the motors among MuJoCo's coordinates, shape (n,).
        laws: Gains of velocity, position and integral, friction and its width, shape (5, n).
        s: Integrators, shape (n,); changed [rad s].
        q: MuJoCo's coordinates [rad].
        qd: Their velocities [rad/s].
        applied: Result at the motors: torques [N m].
    """
    for j in range(motors.shape[0]):
        m = motors[j]
        q_r = start[0, j] + share * (end[0, j] - start[0, j])
        qd_r = start[1, j] + share * (end[1, j] - start[1, j])
        torque = start[2, j] + share * (end[2, j] - start[2, j])
        steep = qd[m] / laws[4, j]
        torque += laws[0, j] * qd_r + laws[1, j] * (q_r - q[m]) + laws[2, j] * s[j]
        applied[m] = torque + laws[3, j] * (steep - math.tanh(steep))
        s[j] += timestep * (q_r - q[m])


class SecondOpinion:
    """The flexible arm and its drives in MuJoCo.

    A motor is a rotor of inertia B in a separate body; a gear is the spring of a fixed tendon between its angle and
    the joint's. The velocity gain and the slope of friction at rest are joint damping, which MuJoCo integrates
    implicitly; the rest of the drive is a torque on the rotor.

    Args:
        description: The robot.
        payload: Carried payload.
        timestep: Time step of MuJoCo's integrator, a fraction of 2 ms [s]. 1 ms is unstable for the UR5e.
        model: A model of which the arm of `arm_spec` is the first part, in a world; None for the arm alone.

    Raises:
        ValueError: 2 ms is not a multiple of the time step.
    """

    def __init__(
        self,
        description: RobotDescription,
        payload: Payload,
        timestep: float,
        model: "mujoco.MjModel | None" = None,
    ) -> None:
        self._steps = round(PERIOD / timestep)
        if self._steps < 1 or abs(self._steps * timestep - PERIOD) > 1e-12:
            raise ValueError(f"timestep is {timestep} s; {PERIOD} s must be a multiple of it")
        self._timestep = timestep
        drives = description.drives
        self._velocity_gain = np.array(drives.velocity_gain)
        self._position_gain = self._velocity_gain * (
            np.array(drives.position_gain) + np.array(drives.integral_gain)
        )
        self._integral_gain = (
            self._velocity_gain * np.array(drives.position_gain) * np.array(drives.integral_gain)
        )
        friction = np.array(drives.coulomb_friction) * (not drives.linear_friction)
        self._gear_stiffness = np.array(drives.gear_stiffness)
        width = np.full(description.joints, drives.friction_width)
        self._laws = np.array(
            [self._velocity_gain, self._position_gain, self._integral_gain, friction, width]
        )
        self._model = arm_spec(description, payload, timestep).compile() if model is None else model
        self.data = data = mujoco.MjData(self._model)
        """MuJoCo's state."""

        def dofs(names: list[str]) -> NDArray[np.int64]:
            return np.array([self._model.joint(name).dofadr[0] for name in names], dtype=np.int64)

        links = description.link_flexibility.links
        self._joints = dofs([joint_name(number) for number in range(description.joints)])
        self._motors = dofs([motor_name(number) for number in range(description.joints)])
        self._flexes = dofs([flex_name(number, axis) for number in links for axis in "yz"])
        self._flange, self._load = self._model.body(FLANGE).id, self._model.body(LOAD).id
        self._root = self._model.body_rootid[self._load]
        self._flex_stiffness = np.repeat(description.link_flexibility.stiffness, 2)
        self._s = np.zeros(description.joints)
        self._command = np.zeros((3, description.joints))
        self._state = data.qpos, data.qvel, data.qfrc_applied
        self._place, self._turn = data.xpos[self._flange], data.xmat[self._flange]
        self._felt = np.zeros(6)
        self._evaluated = False
        """Whether MuJoCo has evaluated the present positions and velocities already."""

    def reset(self, command: DriveCommand) -> Floats:
        """Set static equilibrium under a command, with preloaded integrators; return link-side q, shape (n,) [rad]."""
        data, self._evaluated = self.data, False
        mujoco.mj_resetData(self._model, data)
        self._command = np.array([command.q, command.qd, command.torque])
        gravity = np.zeros(self._model.nv)
        for _ in range(20):
            data.qpos[self._joints] = command.q - gravity[self._joints] / self._gear_stiffness
            data.qpos[self._flexes] = -gravity[self._flexes] / self._flex_stiffness
            data.qpos[self._motors] = command.q
            mujoco.mj_forward(self._model, data)
            gravity = data.qfrc_bias.copy()
        self._s = (gravity[self._joints] - command.torque) / self._integral_gain
        return self.q

    def step(self, command: DriveCommand) -> None:
        """Simulate 2 ms while the drives approach the command linearly."""
        self._move(np.array([command.q, command.qd, command.torque]))

    def _move(self, end: Floats) -> None:
        start, model, data, steps = self._command, self._model, self.data, self._steps
        timestep, motors, laws, s = self._timestep, self._motors, self._laws, self._s
        step, (q, qd, applied) = mujoco.mj_step, self._state
        for k in range(steps):
            drive(start, end, (k + 0.5) / steps, timestep, motors, laws, s, q, qd, applied)
            if self._evaluated:  # the first half of MuJoCo's step is done
                mujoco.mj_step2(model, data)
                self._evaluated = False
            else:
                step(model, data)
        self._command = end

    def play(self, commands: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        """Simulate many periods, each as `step` does.

        Args:
            commands: Rows q_r, q̇_r and τ_ff of each command, shape (T, 3, n).

        Returns:
            After each: link-side angles, their velocities and the torques of the motors, shape (T, n); specific force
            in the flange frame and position of the flange, shape (T, 3), and its orientation, shape (T, 3, 3).
        """
        T, n = len(commands), len(self._motors)
        angles, speeds = np.empty((T, self._model.nq)), np.empty((T, self._model.nv))
        sums = np.empty((T, n))
        force, position, turned = np.empty((T, 3)), np.empty((T, 3)), np.empty((T, 9))
        q, qd, _ = self._state
        for k, command in enumerate(commands):
            self._move(command)
            self._feel()
            angles[k], speeds[k], sums[k] = q, qd, self._s
            force[k], position[k], turned[k] = self._felt[3:], self._place, self._turn
        moments = self._moments(commands, angles[:, self._motors], speeds[:, self._motors], sums)
        q, qd = angles[:, self._joints], speeds[:, self._joints]
        return q, qd, moments, force, position, turned.reshape(T, 3, 3)

    def flange(self) -> tuple[Floats, Floats]:
        """Specific force in the flange frame [m/s^2], shape (3,), and its orientation, shape (3, 3)."""
        self._feel()
        return self._felt[3:].copy(), np.array(self._turn).reshape(3, 3)

    def _feel(self) -> None:
        """Evaluate the accelerations at the present state."""
        model, data = self._model, self.data
        mujoco.mj_forward(model, data)
        self._evaluated = True
        mujoco.mj_rnePostConstraint(model, data)  # accelerations in MuJoCo include gravity's
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._flange, self._felt, 1)

    def wrench(self) -> Floats:
        """What all beyond the flange exerts on it, in its frame, shape (6,) [N, N m]; to be asked after `flange`."""
        data, turn = self.data, self._turn.reshape(3, 3)
        whole = data.cfrc_int[self._load]  # of the flange, about the centre of mass of the arm
        x, y, z = (data.subtree_com[self._root] - self._place).tolist()
        fx, fy, fz = whole[3:].tolist()
        moment = whole[:3] + np.array([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
        felt = np.empty(6)
        felt[:3], felt[3:] = -whole[3:] @ turn, -moment @ turn
        return felt

    def push(self, torque: Floats) -> None:
        """Apply torques to the link side of the joints from now on, shape (n,) [N m]."""
        self.data.qfrc_applied[self._joints] = torque

    def carry(self, payload: Payload) -> None:
        """Carry another payload from now on; positions and velocities stay."""
        model, load = self._model, self._load
        model.body_mass[load], model.body_ipos[load] = payload.mass, payload.com
        model.body_inertia[load], model.body_iquat[load] = principal(payload.inertia)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        self._evaluated = False

    def flange_position(self) -> Floats:
        """Position of the flange, shape (3,) [m]."""
        return np.array(self._place)

    @property
    def q(self) -> Floats:
        """Link-side joint angles, shape (n,) [rad]."""
        return np.array(self.data.qpos[self._joints])

    @property
    def qd(self) -> Floats:
        """Link-side joint velocities, shape (n,) [rad/s]."""
        return np.array(self.data.qvel[self._joints])

    @property
    def motor_q(self) -> Floats:
        """Motor angles on the joint side, shape (n,) [rad]."""
        return np.array(self.data.qpos[self._motors])

    @property
    def motor_qd(self) -> Floats:
        """Motor velocities on the joint side, shape (n,) [rad/s]."""
        return np.array(self.data.qvel[self._motors])

    @property
    def link_deflection(self) -> Floats:
        """Angles of the virtual joints of bending links [rad]."""
        return np.array(self.data.qpos[self._flexes])

    def moment(self) -> Floats:
        """Torques of the motors on the joint side, shape (n,) [N m]."""
        return self._moments(self._command, self.motor_q, self.motor_qd, self._s)

    def _moments(self, command: Floats, q: Floats, qd: Floats, s: Floats) -> Floats:
        """The same for many states, each of shape (T, n), and commands of shape (T, 3, n)."""
        q_r, qd_r, torque = np.moveaxis(command, -2, 0)
        feedback = self._velocity_gain * (qd_r - qd) + self._position_gain * (q_r - q)
        return np.asarray(torque + feedback + self._integral_gain * s)

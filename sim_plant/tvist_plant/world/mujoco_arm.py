"""The arm in MuJoCo as a plant, alone or in a scene.

An independent model of the same description as `FlexibleArm`; MuJoCo computes the dynamics and integrates
them (semi-implicit Euler with implicit damping, first order). Gears have no kinematic error.
"""

import math
from collections.abc import Callable
from copy import copy
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tvist_kernels.compiling import compiled
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import FLANGE, Floats
from tvist_plant.plant import PERIOD, Measurement, Plant, PlantError, PlantTruth, SimulatedArm
from tvist_plant.sensors import Accelerometer, ForceSensor
from tvist_plant.surroundings import Hand, Things
from tvist_plant.world.apart import build_apart
from tvist_plant.world.arm_form import LOAD, arm_spec, carry, hinges, settle
from tvist_plant.world.contacts import PREFIX, set_contacts
from tvist_plant.world.fingers import Fingers
from tvist_plant.world.scene import World
from tvist_plant.world.scene_file import SceneFile

TIMESTEP = 0.00025  # time step at which MuJoCo agrees with `FlexibleArm` [s]
DEEPEST = 1e-4  # largest penetration of an arm at the pose of a reset [m]
_OF_HANDS = (Plant.mount, Plant.grip, Plant.opening)


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
    """Compute the drives' torques [N m] for one MuJoCo step, and step their integrators s.

    Commands have rows q_r, q̇_r, τ_ff; `laws` has rows K_d, position gain, integral gain, friction, width.
    MuJoCo integrates velocity gain and the slope of friction at rest as joint damping.
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


class MujocoArm(SimulatedArm):
    """The arm in MuJoCo: deterministic, in a scene with sensor noise, a force sensor and possibly a gripper.

    Raise ValueError unless `PERIOD` is a multiple of `timestep` [s] (1 ms is unstable for the UR5e), and
    SceneError if the scene is invalid or no arm can stand in it.
    """

    def __init__(
        self,
        description: RobotDescription,
        payload: Payload,
        scene: SceneFile | None = None,
        *,
        timestep: float = TIMESTEP,
    ) -> None:
        self._steps = round(PERIOD / timestep)
        if self._steps < 1 or abs(self._steps * timestep - PERIOD) > 1e-12:
            raise ValueError(f"timestep is {timestep} s: must divide {PERIOD} s")
        self._description, self._scene, self._timestep = description, scene, timestep
        drives, joints = description.drives, description.joints
        K_d, K_p, K_i = map(np.array, (drives.velocity_gain, drives.position_gain, drives.integral_gain))
        friction = np.array(drives.coulomb_friction) * (not drives.linear_friction)
        width = np.full(joints, drives.friction_width)
        self._laws = np.array([K_d, K_d * (K_p + K_i), K_d * K_p * K_i, friction, width])
        self._s, self._command, self._felt = np.zeros(joints), np.zeros((3, joints)), np.zeros(6)
        self._fingers: Fingers | None = None
        self._build(payload, None)
        self._seed(0)

    def _build(self, payload: Payload, hand: Hand | None) -> None:
        description, self.payload = self._description, payload
        if self._scene is None:
            self._world = World(arm_spec(description, payload, self._timestep).compile())
        else:
            self._world = build_apart((description, payload, self._scene, self._timestep, hand))
        self._model = model = self._world.model
        self._bodies, self._own = (np.array(own, np.int64) for own in (self._world.bodies, self._world.arm))
        self._data = data = mujoco.MjData(model)
        self._joints, self._motors, self._flexes = hinges(description, model)
        self._flange, self._load = model.body(FLANGE).id, model.body(LOAD).id
        self._state = data.qpos, data.qvel, data.qfrc_applied
        self._place, self._turn = data.xpos[self._flange], data.xmat[self._flange]
        self._evaluated = False  # whether MuJoCo has already evaluated the present positions and velocities

    def _seed(self, seed: int) -> None:
        sensors, alone = self._description.sensors, self._scene is None
        self._accelerometer = Accelerometer(0.0 if alone else sensors.accelerometer_noise, seed)
        self._sensor = ForceSensor(
            (sensors.force_noise, sensors.torque_noise), (sensors.force_offset, sensors.torque_offset), seed
        )

    def can(self, method: Callable[..., Any]) -> bool:
        """Return whether the plant has a method; without a scene it has no gripper."""
        return super().can(method) and (self._scene is not None or method not in _OF_HANDS)

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest in static equilibrium under a command, and reset the scene's bodies."""
        self._seed(seed)
        if self._fingers is not None:
            self._fingers.open()
        if payload is not None and payload != self.payload:
            self.load(payload)
        self._evaluated, self._command = False, np.array([command.q, command.qd, command.torque])
        weight = settle(self._description, self._model, self._data, command.q)
        self._s = (weight - command.torque) / self._laws[2]
        measured = self._measure()
        if (met := self._met(self._data)) is not None:
            raise PlantError(f"{met}: choose a posture in which the arm is clear")
        return measured

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one period."""
        self.move(command)
        measured = self._measure()
        if not math.isfinite(self._force.dot(self._force)):
            raise PlantError("the state of the arm in MuJoCo is no longer finite")
        if self._bodies.size and not np.isfinite(self._data.xpos[self._bodies]).all():
            raise PlantError("the position of a body around the arm is no longer finite")
        return measured

    def move(self, command: DriveCommand) -> None:
        """Simulate one period, in which drives' commands change linearly from the last to the given ones."""
        if self._fingers is not None:
            self._fingers.drive(self._data)
        start, end = self._command, np.array([command.q, command.qd, command.torque])
        model, data, steps, timestep = self._model, self._data, self._steps, self._timestep
        motors, laws, s, (q, qd, applied) = self._motors, self._laws, self._s, self._state
        for k in range(steps):
            drive(start, end, (k + 0.5) / steps, timestep, motors, laws, s, q, qd, applied)
            if self._evaluated:  # first half of MuJoCo's step already done
                mujoco.mj_step2(model, data)
                self._evaluated = False
            else:
                mujoco.mj_step(model, data)
        self._command = end

    def _measure(self) -> Measurement:
        model, data = self._model, self._data
        mujoco.mj_forward(model, data)
        self._evaluated = True
        mujoco.mj_rnePostConstraint(model, data)  # accelerations in MuJoCo include gravity's
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._flange, self._felt, 1)
        self._force, self._rotation = self._felt[3:].copy(), self._turn.reshape(3, 3).copy()
        q, qd = data.qpos[self._motors], data.qvel[self._motors]
        (q_r, qd_r, torque), (K_d, K, K_s, _, _) = self._command, self._laws
        return Measurement(
            q=data.qpos[self._joints],
            qd=data.qvel[self._joints],
            moment=torque + (K_d * (qd_r - qd) + K * (q_r - q)) + K_s * self._s,
            accelerometer=self._accelerometer.read(self._force),
            wrench=None if self._scene is None else self._sensor.read(self._wrench()),
        )

    def _wrench(self) -> Floats:
        """Return the wrench on the flange by everything beyond it, in its frame, shape (6,) [N, N m]."""
        data, load = self._data, self._load
        whole = data.cfrc_int[load]  # wrench of the flange on the load, about the centre of mass of the arm
        x, y, z = (data.subtree_com[self._model.body_rootid[load]] - self._place).tolist()
        fx, fy, fz = whole[3:].tolist()
        moment = whole[:3] + np.array([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
        felt = np.empty(6)
        felt[:3], felt[3:] = -whole[3:] @ self._rotation, -moment @ self._rotation
        return felt

    def truth(self) -> PlantTruth:
        """Return the present values that a real robot cannot measure."""
        q, qd, _ = self._state
        return PlantTruth(
            motor_q=q[self._motors],
            motor_qd=qd[self._motors],
            gear_deflection=q[self._joints] - q[self._motors],
            link_deflection=q[self._flexes],
            flange_position=self._place.copy(),
            flange_rotation=self._rotation,
            specific_force=self._force,
        )

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on; the collision shape stays that of the first payload."""
        self.payload, self._evaluated = payload, False
        carry(self._model, payload)
        set_contacts(self._model, self._world.contacts)  # stiffness of contacts is relative to the masses

    def push(self, torque: Floats) -> None:
        """Apply external torques to the joints."""
        self._data.qfrc_applied[self._joints] = torque

    def make_nan(self) -> None:
        """Make the state NaN; the next step then raises `PlantError`."""
        self._data.qvel[0] = np.nan

    # ------------------------------------------------------------------ the world

    def things(self) -> Things | None:
        """Return the objects around the arm."""
        return self._world.things

    def places(self) -> Floats:
        """Return the poses of the moving bodies, shape (bodies, 6) [m, rad]."""
        data = self._data
        turns = [pin.log3(data.xmat[body].reshape(3, 3)) for body in self._bodies]
        return np.concatenate([data.xpos[self._bodies], np.reshape(turns, (-1, 3))], axis=1)

    def contact(self) -> Floats:
        """Return the contact force on the arm, base frame, shape (3,) [N]."""
        return np.asarray(self._data.cfrc_ext[self._own, 3:].sum(axis=0))

    def obstacle(self, q: Floats, payload: Payload | None) -> str | None:
        """Return what the arm would overlap after a reset, None if nothing."""
        model = copy(self._model)
        if payload is not None:
            carry(model, payload)  # the payload's weight bends the arm
        data = mujoco.MjData(model)
        settle(self._description, model, data, q)
        return self._met(data)

    def _met(self, data: "mujoco.MjData") -> str | None:
        for touch in data.contact[: data.ncon]:
            geoms = [self._model.geom(geom) for geom in touch.geom]
            ours = any(one.bodyid[0] in self._world.arm or one.name.startswith("arm ") for one in geoms)
            if self._scene is not None and ours and touch.dist < -DEEPEST:
                first, second = (one.name.removeprefix(PREFIX) for one in geoms)
                return f"world {self._scene.name}: {first} stands {-1e3 * touch.dist:.3g} mm inside {second}"
        return None

    # ------------------------------------------------------------------ the gripper

    def mount(self, hand: Hand) -> None:
        """Mount a gripper, before the first reset."""
        self._build(self.payload, hand)
        self._fingers = Fingers(self._model, hand)

    def grip(self, opening: float, force: float) -> None:
        """Move the fingers from the next step on."""
        if self._fingers is not None:
            self._fingers.wanted, self._fingers.force = opening, force

    def opening(self) -> float:
        """Return the measured distance between the fingers [m]."""
        assert self._fingers is not None
        return self._fingers.opening(self._data)

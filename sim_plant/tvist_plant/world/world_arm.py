"""The arm in MuJoCo among things that it touches, as a plant."""

from copy import copy

import mujoco
import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.plant import Hand, Measurement, PlantError, Response, Things
from tvist_plant.sensors import Accelerometer, ForceSensor
from tvist_plant.world.apart import build_apart
from tvist_plant.world.contacts import PREFIX, set_contacts
from tvist_plant.world.fingers import Fingers
from tvist_plant.world.mujoco_arm import TIMESTEP, MujocoArm
from tvist_plant.world.scene_file import SceneFile
from tvist_plant.world.second_opinion import SecondOpinion

DEEPEST = 1e-4
"""Depth up to which an arm may touch something where it is put [m]."""


class WorldArm(MujocoArm):
    """The arm in a scene: a `Plant` that is `InWorld`, `Gripping`, and has a force sensor in its flange.

    It is deterministic. Gears have no kinematic error.

    Args:
        description: The arm.
        payload: Carried payload.
        scene: The scene.

    Raises:
        SceneError: The file is no scene, or no arm can stand in it.
    """

    def __init__(self, description: RobotDescription, payload: Payload, scene: SceneFile) -> None:
        self._scene = scene
        self._hand: Hand | None = None
        self._fingers: Fingers | None = None
        super().__init__(description, payload)
        self._seeded(0)

    def _made(self, payload: Payload) -> SecondOpinion:
        self._world = build_apart((self._description, payload, self._scene, TIMESTEP, self._hand))
        self._bodies, self._own = (
            np.array(one, dtype=np.int64) for one in (self._world.bodies, self._world.arm)
        )
        return SecondOpinion(self._description, payload, TIMESTEP, self._world.model)

    def _load(self, payload: Payload) -> None:
        if hasattr(self, "_arm"):
            self.load(payload)
        else:
            super()._load(payload)

    def _seeded(self, seed: int) -> None:
        sensors = self._description.sensors
        self._accelerometer = Accelerometer(sensors.accelerometer_noise, seed)
        self._sensor = ForceSensor(
            (sensors.force_noise, sensors.torque_noise), (sensors.force_offset, sensors.torque_offset), seed
        )

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest, and the things where the scene has them; see `Plant.reset`.

        Raises:
            PlantError: The arm would stand in something.
        """
        self._seeded(seed)
        if self._fingers is not None:
            self._fingers.open()
        measured = super().reset(command, payload=payload, seed=seed)
        met = self._met(self._arm.data)
        if met is not None:
            raise PlantError(f"{met}: choose a posture in which the arm is clear")
        return measured

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one period.

        Raises:
            PlantError: The state is no longer finite.
        """
        if self._fingers is not None:
            self._fingers.drive(self._arm.data)
        measured = super().step(command)
        if self._bodies.size and not np.isfinite(self._arm.data.xpos[self._bodies]).all():
            raise PlantError("what stands around the arm is no longer anywhere")
        return measured

    def play(self, commands: Floats) -> Response:
        """Move the arm by many periods; see `Playable`."""
        rows = []
        for command in commands:
            measured = self.step(DriveCommand(*command))
            rows.append((measured, self._force, self._arm.flange_position(), self._rotation))
        measured_, *felt = zip(*rows, strict=True)
        names = ("q", "qd", "moment", "accelerometer", "wrench")
        q, qd, moment, force, wrench = (np.array([getattr(one, name) for one in measured_]) for name in names)
        measured = Measurement(q, qd, moment, force, wrench=wrench)
        return Response(measured, *(np.array(column) for column in felt))

    def _measure(self) -> Measurement:
        measured = super()._measure()
        measured.accelerometer = self._accelerometer.read(self._force)
        measured.wrench = self._sensor.read(self._arm.wrench())
        return measured

    # ------------------------------------------------------------------ what only a simulation can have

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on; see `Loadable`. Its shape in the world stays the first one's."""
        self._payload = payload
        self._arm.carry(payload)
        set_contacts(self._world.model, self._world.contacts)  # their stiffness is relative to the masses

    def push(self, torque: Floats) -> None:
        """Apply external torques to the joints; see `Pushable`."""
        self._arm.push(torque)

    def make_nan(self) -> None:
        """Make the state NaN, so that the next step raises `PlantError`."""
        self._arm.data.qvel[0] = np.nan

    # ------------------------------------------------------------------ the world

    def things(self) -> Things:
        """Return what stands around it; see `InWorld`."""
        return self._world.things

    def places(self) -> Floats:
        """Return the poses of the bodies that move, shape (bodies, 6) [m, rad]."""
        data = self._arm.data
        turns = [pin.log3(data.xmat[body].reshape(3, 3)) for body in self._bodies]
        return np.concatenate([data.xpos[self._bodies], np.reshape(turns, (-1, 3))], axis=1)

    def contact(self) -> Floats:
        """Return the force of all that touches the arm, base frame, shape (3,) [N]."""
        return np.asarray(self._arm.data.cfrc_ext[self._own, 3:].sum(axis=0))

    def obstacle(self, q: Floats, payload: Payload | None) -> str | None:
        """Say what the arm would stand in after a reset; see `InWorld`."""
        arm = SecondOpinion(self._description, self._payload, TIMESTEP, copy(self._world.model))
        if payload is not None:
            arm.carry(payload)  # it bends the arm
        arm.reset(DriveCommand(q, np.zeros(len(q)), np.zeros(len(q))))
        return self._met(arm.data)

    def _met(self, data: "mujoco.MjData") -> str | None:
        """Say what the arm stands in; None if it is clear."""
        model = self._world.model
        for touch in data.contact[: data.ncon]:
            bodies = [int(model.geom_bodyid[geom]) for geom in touch.geom]
            if touch.dist < -DEEPEST and any(body in self._world.arm or model.geom(geom).name.startswith("arm ")
                                             for body, geom in zip(bodies, touch.geom, strict=True)):  # fmt: skip
                first, second = (model.geom(geom).name.removeprefix(PREFIX) for geom in touch.geom)
                depth = -1e3 * touch.dist
                return f"world {self._scene.name}: {first} stands {depth:.3g} mm inside {second}"
        return None

    # ------------------------------------------------------------------ the gripper

    def mount(self, hand: Hand) -> None:
        """Mount a gripper, before the first reset; see `Gripping`."""
        self._hand = hand
        super()._load(self._payload)
        self._fingers = Fingers(self._world.model, hand)

    def grip(self, opening: float, force: float) -> None:
        """Move the fingers from the next step on; see `Gripping`."""
        if self._fingers is not None:
            self._fingers.wanted, self._fingers.force = opening, force

    def opening(self) -> float:
        """Return the measured distance between the fingers [m]."""
        assert self._fingers is not None
        return self._fingers.opening(self._arm.data)

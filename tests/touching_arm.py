"""The flexible arm above a damped elastic surface, with or without a force sensor in its flange."""

import numpy as np

from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement

PARTS = 4  # steps of constant contact force in a control period, for surfaces of up to 1e5 N/m


class TouchingArm:
    """A `FlexibleArm` whose flange presses into a plane of normal z when it is below `height`.

    Args:
        stiffness: Stiffness of the surface [N/m].
        damping: Damping of the surface, which never pulls [N s/m].
        sensor: Whether the flange has a force sensor, which also measures weight and inertia of the payload.
    """

    def __init__(self, description, payload, *, stiffness=0.0, damping=0.0, sensor=True):
        self._arm, self.sensor = FlexibleArm(description, payload, period=PERIOD / PARTS, substeps=1), sensor
        self.stiffness, self.damping, self.height = stiffness, damping, -1e9
        self.pushed = np.zeros(3)
        self.force = np.zeros(3)

    def __getattr__(self, name):
        return getattr(self._arm, name)

    def reset(self, command, *, payload=None, seed=0):
        self.force = np.zeros(3)
        measured = self._arm.reset(command, payload=payload, seed=seed)
        self._last, self._z = command, self._place()
        return self._sensed(measured)

    def _place(self):
        return float(self._arm.truth().flange_position[2])

    def step(self, command):
        last = self._last
        for k in range(1, PARTS + 1):
            share = k / PARTS
            z = self._place()
            rate, self._z = (z - self._z) * PARTS / PERIOD, z
            deep = self.height - z
            push = max(self.stiffness * deep - self.damping * rate, 0.0) if deep > 0.0 else 0.0
            self.force = np.array([0.0, 0.0, push]) + self.pushed
            self._arm.push_body("flange", self.force)
            q, qd, torque = (
                (1.0 - share) * getattr(last, name) + share * getattr(command, name)
                for name in ("q", "qd", "torque")
            )
            measured = self._arm.step(DriveCommand(q, qd, torque))
        self._last = command
        return self._sensed(measured)

    def _sensed(self, measured):
        if not self.sensor:
            return measured
        rotation, payload = self._arm.truth().flange_rotation, self._arm.payload
        inertial = -payload.mass * measured.accelerometer
        wrench = np.concatenate((inertial + rotation.T @ self.force, np.cross(payload.com, inertial)))
        return Measurement(measured.q, measured.qd, measured.moment, measured.accelerometer, wrench=wrench)

"""The flexible arm in MuJoCo as a plant: a second implementation for a controller to drive."""

import math

import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.plant import Measurement, PlantError, PlantTruth, Response
from tvist_plant.world.second_opinion import SecondOpinion

TIMESTEP = 0.00025
"""Time step at which MuJoCo agrees with `FlexibleArm` [s]."""


class MujocoArm:
    """The arm in MuJoCo: a `Plant` without external pushes, faults and true modes.

    It is deterministic: it has neither sensor noise nor gear errors, and ignores seeds.

    Args:
        description: The arm.
        payload: Carried payload.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._description = description
        self._load(payload)

    def _load(self, payload: Payload) -> None:
        self._payload, self._arm = payload, self._made(payload)

    def _made(self, payload: Payload) -> SecondOpinion:
        return SecondOpinion(self._description, payload, TIMESTEP)

    @property
    def payload(self) -> Payload:
        """Carried payload."""
        return self._payload

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:  # noqa: ARG002
        """Put the arm at rest in static equilibrium under a command; see `Plant.reset`."""
        if payload is not None and payload != self._payload:
            self._load(payload)
        self._arm.reset(command)
        return self._measure()

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one period.

        Raises:
            PlantError: The state is no longer finite.
        """
        self._arm.step(command)
        measured = self._measure()
        if not math.isfinite(self._force.dot(self._force)):
            raise PlantError("the state of the arm in MuJoCo is no longer finite")
        return measured

    def play(self, commands: Floats) -> Response:
        """Move the arm by many periods; see `Playable`.

        Raises:
            PlantError: The state is no longer finite.
        """
        q, qd, moment, force, position, turned = self._arm.play(np.ascontiguousarray(commands, dtype=float))
        if not (np.isfinite(force).all() and np.isfinite(position).all()):
            raise PlantError("the state of the arm in MuJoCo is no longer finite")
        if len(commands):
            self._force, self._rotation = force[-1].copy(), turned[-1].copy()
        return Response(Measurement(q, qd, moment, force.copy()), force, position, turned)

    def _measure(self) -> Measurement:
        arm = self._arm
        self._force, self._rotation = arm.flange()
        return Measurement(q=arm.q, qd=arm.qd, moment=arm.moment(), accelerometer=self._force.copy())

    def truth(self) -> PlantTruth:
        """Return what a real robot cannot measure, at the present state."""
        arm = self._arm
        return PlantTruth(
            motor_q=arm.motor_q,
            motor_qd=arm.motor_qd,
            gear_deflection=arm.q - arm.motor_q,
            link_deflection=arm.link_deflection,
            flange_position=arm.flange_position(),
            flange_rotation=self._rotation,
            specific_force=self._force,
        )

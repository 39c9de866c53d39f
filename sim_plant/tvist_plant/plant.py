"""Interface between a controller and a plant: drive commands in, measurements out, one control period at a time.

A controller requires only `Plant`. Abilities that only some plants have are interfaces of their own, which a plant
implements by having the method: `Pushable`, `Breakable`, `ModalPlant`.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.modes import Modes

PERIOD = 0.002
"""Control period [s]."""
GRAVITY = 9.81
"""Gravitational acceleration, along the base's negative z axis [m/s²]."""


class PlantError(ArithmeticError):
    """The plant's state is no longer finite, because it was driven beyond the validity of its model."""


@dataclass(slots=True, eq=False)
class Measurement:
    """Measurements of a robot's own sensors.

    The class is not frozen, since one is created at every tick, and that would take five times as long.
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
class PlantTruth:
    """Quantities that a real robot cannot measure, but a simulation knows."""

    motor_q: Floats
    """Motor angles on the joint side θ, shape (n,) [rad]."""
    motor_qd: Floats
    """Motor velocities on the joint side, shape (n,) [rad/s]."""
    gear_deflection: Floats
    """q - θ, shape (n,) [rad]."""
    link_deflection: Floats
    """Angles of the virtual joints by which links bend; empty if links are rigid [rad]."""
    flange_position: Floats
    """Position of the flange, including deflections, shape (3,) [m]."""
    flange_rotation: Floats
    """Orientation of the flange, deflections included, shape (3, 3)."""
    specific_force: Floats
    """Specific force in the flange frame without noise, shape (3,) [m/s^2]."""
    static_gear_deflection: Floats | None = None
    """Part of `gear_deflection` that remains at rest in this pose, shape (n,); None: unknown [rad]."""
    static_link_deflection: Floats | None = None
    """Part of `link_deflection` that remains at rest in this pose; None: unknown [rad]."""


@dataclass(frozen=True)
class Response:
    """What a plant did in T consecutive periods."""

    measured: Measurement
    """Measurements after each, with arrays of shape (T, n) and (T, 3)."""
    specific_force: Floats
    """Specific force in the flange frame without noise, shape (T, 3) [m/s^2]."""
    flange_position: Floats
    """Position of the flange, shape (T, 3) [m]."""
    flange_rotation: Floats
    """Orientation of the flange, shape (T, 3, 3)."""


class Plant(Protocol):
    """An arm with its drives, simulated or real.

    A controller owns its plant: no other code steps or resets it, and controllers do not share plants. The controller
    resets the plant when it starts, takes a few steps at rest, and resets it again; from then on it calls `step` once
    in every control period of `PERIOD` seconds.

    An implementation guarantees:

    - n joints, as many as in the robot's description, in its order and with its signs and zeros;
    - that equal resets and equal commands give equal measurements to the last bit, if runs are to be replayed;
    - that returned arrays are not changed later, since they belong to the receiver;
    - that the command's arrays are neither kept nor changed;
    - that each call returns within the control period, if the clock is real time.
    """

    @property
    def payload(self) -> Payload:
        """Carried payload, as far as it is known; it determines how far the arm moves when the brakes close."""

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest under a command without motion, as if it had stood there for a long time.

        Args:
            command: Position to hold, shape (n,) [rad], feed-forward torque [N m], and a velocity of zero.
            payload: New carried payload; None to keep the present one.
            seed: Seed of all random effects, such as sensor noise.

        Raises:
            ValueError: The arm cannot be there, or cannot carry the payload, so that no controller can start with it.
                Once its controller has started, a plant must not raise this.
        """

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one control period.

        Args:
            command: Set-points for the end of the period; the drives go linearly from the previous ones to these.

        Returns:
            Measurements at the end of the period.

        Raises:
            PlantError: The state is no longer finite. The controller makes a protective stop and resets the plant.
        """

    def truth(self) -> PlantTruth | None:
        """Return what a real robot cannot measure, after the last step or reset; None if that is unknown."""


@runtime_checkable
class Pushable(Protocol):
    """A plant that supports external torques on its joints, for the fault `torque`."""

    def push(self, torque: Floats) -> None:
        """Apply external torques to the joints, until they are changed or the arm is reset.

        Args:
            torque: Torques on the link side, shape (n,); zeros end the push [N m].
        """


@runtime_checkable
class Breakable(Protocol):
    """A plant whose equations can be made to fail: fault `nan`."""

    def make_nan(self) -> None:
        """Make the state NaN, so that the next step raises `PlantError`."""


@runtime_checkable
class Playable(Protocol):
    """A plant that computes many periods in one call, with the same results to the last bit as one by one."""

    def play(self, commands: Floats) -> Response:
        """Move the arm by T control periods.

        Args:
            commands: Position, velocity and torque of the command for the end of each, shape (T, 3, n).

        Raises:
            PlantError: The state is no longer finite.
        """


@runtime_checkable
class ModalPlant(Protocol):
    """A plant that knows its vibration modes."""

    def modes(self, q: Floats | None = None) -> Modes:
        """Return the vibration modes of the closed loop at rest.

        Args:
            q: Joint positions, shape (n,) [rad]; None for the present ones.
        """


def played(plant: Plant, commands: Floats) -> Response:
    """Let a plant move by T control periods, one by one.

    Args:
        plant: The plant; it must provide the truth.
        commands: See `Playable.play`.

    Raises:
        PlantError: See `Plant.step`.
        ValueError: The plant does not provide the truth.
    """
    rows = []
    for command in commands:
        measured, truth = plant.step(DriveCommand(*command)), plant.truth()
        if truth is None:
            raise ValueError(f"the plant {type(plant).__name__} does not provide the truth")
        own = (measured.q, measured.qd, measured.moment, measured.accelerometer)
        rows.append((*own, truth.specific_force, truth.flange_position, truth.flange_rotation))
    q, qd, moment, accelerometer, *felt = (np.array(column) for column in zip(*rows, strict=True))
    return Response(Measurement(q, qd, moment, accelerometer), *felt)


def check_measurement(measured: Measurement, joints: int, plant: Plant) -> None:
    """Check the first measurement of a plant, which may be a user's own.

    Args:
        measured: Measurement that it returned.
        joints: Number of joints in the robot's description.
        plant: The plant, named in the error.

    Raises:
        ValueError: An array is missing or has the wrong shape, for example for another number of joints.
    """
    for name, shape in (("q", (joints,)), ("qd", (joints,)), ("moment", (joints,)), ("accelerometer", (3,))):
        found = getattr(getattr(measured, name, None), "shape", None)
        if found != shape:
            what = "is not an array" if found is None else f"has shape {found}"
            raise ValueError(
                f"plant {type(plant).__name__}: measured {name} {what}: its shape must be {shape}"
            )

"""What a controller moves: drive commands in, measurements out, one control period at a time.

`Plant` is all that a controller asks for. What only some plants can do has an interface of its own, which a plant
offers by having the method: `Pushable`, `Breakable`, `ModalPlant`.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.modes import Modes

PERIOD = 0.002
"""Control period [s]."""


class PlantError(ArithmeticError):
    """The plant's state is no longer finite: it was driven beyond what its physics is good for."""


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
class PlantTruth:
    """What no robot can know of itself, and a simulation can."""

    motor_q: Floats
    """Motor angles on the joint side θ, shape (n,) [rad]."""
    motor_qd: Floats
    """Motor velocities on the joint side, shape (n,) [rad/s]."""
    gear_deflection: Floats
    """q - θ, shape (n,) [rad]."""
    link_deflection: Floats
    """Angles of the virtual joints by which links bend, one each; empty where links are rigid [rad]."""
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


class Plant(Protocol):
    """An arm with its drives, simulated or real.

    A controller owns its plant: nobody else steps or resets it, and no two controllers share one. The controller
    resets it when it starts, lets it take a few steps at rest, and resets it again; from then on it calls `step` once
    every control period of `PERIOD` seconds.

    An implementer promises:

    - n joints, as many as the robot's description has, in its order and with its signs and zeros;
    - that equal resets and equal commands give equal measurements to the last bit, if runs are to be replayed;
    - that what is returned is not changed later: arrays are the receiver's own;
    - not to keep or change the command's arrays;
    - to return within the control period, where the clock is real time.
    """

    @property
    def payload(self) -> Payload:
        """What the arm carries, as far as is known; where the brakes close, it decides how far the arm goes."""

    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Put the arm at rest under a command that does not move, as if it had stood there for long.

        Args:
            command: Position to hold, shape (n,) [rad], torque fed forward [N m], and a velocity of zero.
            payload: What the arm carries from now on; None leaves it.
            seed: Seed of everything random, such as sensor noise.

        Raises:
            ValueError: The arm cannot be there, or cannot carry that, and no controller starts with it. A plant whose
                controller has started does what it is told.
        """

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one control period.

        Args:
            command: Set-points for the end of the period; the drives go linearly from the last ones to these.

        Returns:
            What is measured at the end of the period.

        Raises:
            PlantError: The state is no longer finite. The controller makes a protective stop and resets the plant.
        """

    def truth(self) -> PlantTruth | None:
        """What no robot can know, after the last step or reset; None where nobody knows it, as on a real robot."""


@runtime_checkable
class Pushable(Protocol):
    """A plant whose joints something outside can push: fault `torque`."""

    def push(self, torque: Floats) -> None:
        """Push the joints from now on, until this is changed or the arm is reset.

        Args:
            torque: On the link side, shape (n,); zeros let go [N m].
        """


@runtime_checkable
class Breakable(Protocol):
    """A plant whose equations can be made to fail: fault `nan`."""

    def make_nan(self) -> None:
        """Make the state not a number: the next step raises `PlantError`."""


@runtime_checkable
class ModalPlant(Protocol):
    """A plant that knows its vibration modes."""

    def modes(self, q: Floats | None = None) -> Modes:
        """Vibration modes of the closed loop at rest.

        Args:
            q: Joint positions, shape (n,) [rad]; None: where the arm is.
        """


def check_measurement(measured: Measurement, joints: int, plant: Plant) -> None:
    """Check the first measurement of a plant that somebody else may have written.

    Args:
        measured: What it returned.
        joints: Number of joints that the robot's description has.
        plant: Named in the error.

    Raises:
        ValueError: An array is missing or has another shape, as if for another number of joints.
    """
    for name, shape in (("q", (joints,)), ("qd", (joints,)), ("moment", (joints,)), ("accelerometer", (3,))):
        found = getattr(getattr(measured, name, None), "shape", None)
        if found != shape:
            what = "is not an array" if found is None else f"has shape {found}"
            raise ValueError(
                f"plant {type(plant).__name__}: measured {name} {what}: its shape must be {shape}"
            )

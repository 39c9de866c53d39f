"""Interface between a controller and a plant: drive commands in, measurements out, one control period at a time.

A controller requires only `Plant`, and that it is `Placeable` or `Standing`. Other abilities that only some plants have
are interfaces of their own, too, which a plant implements by having the method: a simulation can be pushed and broken,
and knows the truth; a real arm has power, brakes, faults and a clock.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.modes import Modes

PERIOD = 0.002
"""Control period [s]."""
GRAVITY = 9.81
"""Gravitational acceleration, along the base's negative z axis [m/s²]."""


class PlantError(ArithmeticError):
    """A plant has failed: a simulated state is no longer finite, or a real arm does not answer."""


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
    timestamp: float | None = None
    """Time at which the plant measured, by its own clock [s]; None if it has none."""
    wrench: Floats | None = None
    """Force and torque about the flange's origin that all beyond the force sensor exerts on the flange, in its frame,
    shape (6,) [N, N m]: weight, inertia and contact of what is mounted, with noise and offset; a push towards the
    flange reads along the push, as UR's do. None: the plant has no such sensor.
    """


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
    """Angles of the virtual joints by which links bend, about y and z of each; empty if links are rigid [rad]."""
    flange_position: Floats
    """Position of the flange in the world, in which a tilted arm leans; deflections included, shape (3,) [m]."""
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


@runtime_checkable
class Plant(Protocol):
    """An arm with its drives, simulated or real.

    A controller owns its plant: no other code steps or resets it, and controllers do not share plants. When it starts,
    it places the plant if that is `Placeable`, and otherwise begins where the arm stands (`Standing`); from then on it
    calls `step` once in every control period of `PERIOD` seconds, with power or without.

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

    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one control period.

        Args:
            command: Set-points for the end of the period; the drives go linearly from the previous ones to these.

        Returns:
            Measurements at the end of the period.

        Raises:
            PlantError: A simulated state is no longer finite, or a real arm does not answer. A plant that can be placed
                then is, in a protective stop; any other gets no power until the safety system is restarted.
        """


@runtime_checkable
class Placeable(Plant, Protocol):
    """A plant that can be put anywhere at rest, as simulated ones can: `simulation.reset` needs it."""

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


@runtime_checkable
class Standing(Plant, Protocol):
    """A plant that stands somewhere by itself, as a real arm does; every plant is this or `Placeable`."""

    def measure(self) -> Measurement:
        """Return the present measurements without moving the arm.

        Raises:
            PlantError: It does not answer. The robot then cannot begin with it, or does not switch its power on.
        """


@runtime_checkable
class Truthful(Protocol):
    """A plant that knows what a real robot cannot measure."""

    def truth(self) -> PlantTruth | None:
        """Return what a real robot cannot measure, after the last step or reset; None if that is unknown."""


@dataclass(frozen=True)
class Halt:
    """Why an arm's own controller does not follow us any more."""

    why: str
    """The reason, and what to do before the arm can be powered on or unlocked here, in words."""
    safety_mode: int
    """Its safety mode, with RTDE's number."""


@dataclass(frozen=True)
class Condition:
    """What a plant says of its own power."""

    ready: bool
    """Whether the drives hold the arm: they have power, and the brakes are released."""
    fault: str | None = None
    """What is wrong with it, in words; None if nothing is."""
    halt: Halt | None = None
    """Why its own controller has stopped it; None if it has not."""


@runtime_checkable
class Powered(Protocol):
    """A plant whose power and brakes are switched, and which may switch itself off."""

    def switch(self, *, power: bool, brakes: bool) -> None:
        """Ask for another state, which may take a while: `condition` tells when the drives hold the arm.

        Args:
            power: Whether the drives are to have power.
            brakes: Whether the brakes are to hold the arm.
        """

    @property
    def condition(self) -> Condition:
        """Its present condition. If it stops being ready while the robot runs, the robot stops."""


@runtime_checkable
class Stoppable(Protocol):
    """A plant with a stop of its own, for stops that do not go through the control line."""

    def stop(self) -> None:
        """Stop with category 0: no power, brakes closed."""


@runtime_checkable
class Pacing(Protocol):
    """A plant that gives the tick, as a controller does whose states arrive every 2 ms."""

    def wait(self, timeout: float) -> bool:
        """Wait until the next control period begins; return False if it does not within the timeout [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What a robot that its own controller moves has said in one of its cycles."""

    tick: int
    """Number of the control period by the robot's own clock; it increases from one to the next."""
    measured: Measurement
    """Its measurements."""
    target: Floats
    """Position [rad], velocity [rad/s], acceleration [rad/s²] and torque [N m] that it follows, shape (4, n)."""
    modes: tuple[int, int, int]
    """Robot mode, safety mode and runtime state, with RTDE's numbers."""
    speed: float
    """Share of the programmed speed [-]."""
    missed: int
    """Number of cycles since the first that did not arrive."""
    payload: Payload | None = None
    """Payload that it was told; None if it does not say."""
    tool: tuple[float, ...] | None = None
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]; None if it does not say."""
    force: tuple[float, ...] | None = None
    """Force and torque at the tool centre point, base frame [N, N m]; None if it does not say."""
    slider: float | None = None
    """Position of the speed slider [-]; None if it does not say."""
    inputs: int = 0
    """Digital inputs, as RTDE orders the bits."""
    outputs: int = 0
    """Digital outputs, as RTDE orders the bits."""
    told: tuple[str, ...] = ()
    """What people should know, in sentences."""


@runtime_checkable
class Watched(Pacing, Standing, Protocol):
    """A robot that its own controller moves, while we watch: no command reaches it, and `step` only measures."""

    def sight(self) -> Sight:
        """Return what it said in its next cycle, for which `wait` has waited.

        Raises:
            PlantError: It has said nothing since the last call.
        """

    def interval(self) -> float:
        """Return the time between two of its cycles as they arrive [s]."""


@runtime_checkable
class Supervised(Pacing, Standing, Powered, Stoppable, Protocol):
    """A robot that we move through its own controller, which follows our positions and may stop it."""

    def seen(self) -> Sight:
        """Return what it said last; its `told` are those since the last call."""

    def described(self) -> RobotDescription:
        """Return the robot file with limits no wider than the robot's own."""


@runtime_checkable
class Loadable(Protocol):
    """A plant whose carried payload can change while it moves, for the parts and tools of a cell."""

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on. Positions and velocities stay, only forces change.

        Args:
            payload: New carried payload.
        """


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


@dataclass(frozen=True)
class Shape:
    """A primitive shape of a thing."""

    kind: str
    """`plane`, `sphere`, `capsule`, `ellipsoid`, `cylinder` or `box`."""
    size: tuple[float, ...]
    """As MuJoCo's: radius and half of the length along z; half of the lengths; of a plane 0 where it has no end [m]."""
    pose: tuple[float, ...]
    """Pose in the frame of its body: x y z [m] and rotation vector [rad]."""
    body: int | None
    """Number of the body that carries it; None if it stands still, in the frame of the arm's base."""
    colour: tuple[float, ...]
    """Red, green, blue and opacity, 0 to 1."""


@dataclass(frozen=True)
class Things:
    """What stands around an arm."""

    name: str
    """Name of the scene."""
    bodies: tuple[str, ...]
    """Names of the bodies that move."""
    shapes: tuple[Shape, ...]
    """What they, and all that stands still, look like."""
    areas: Mapping[str, Shape]
    """Places of which a test may ask whether a body is there, by their names."""
    unseen: int = 0
    """Number of shapes that are left out, such as meshes."""


@runtime_checkable
class InWorld(Protocol):
    """A plant that stands among things that it touches."""

    def things(self) -> Things:
        """Return what stands around it, which stays the same."""

    def places(self) -> Floats:
        """Return the present poses of the bodies that move, in the frame of the base, shape (bodies, 6) [m, rad]."""

    def contact(self) -> Floats:
        """Return the force of all that touches the arm, its tool or its fingers, base frame, shape (3,) [N]."""

    def obstacle(self, q: Floats, payload: Payload | None) -> str | None:
        """Say what the arm would stand in after a reset; None if it would be clear. Asking changes nothing.

        Args:
            q: Joint angles of the reset, shape (n,) [rad].
            payload: New carried payload; None for the present one.
        """


@dataclass(frozen=True)
class Hand:
    """A gripper whose two fingers close along y of the tool centre point."""

    stroke: float
    """Distance between open fingers [m]."""
    position: Floats
    """Position of the tool centre point in the flange frame, shape (3,) [m]."""
    rotation: Floats
    """Its orientation, shape (3, 3)."""

    @property
    def direction(self) -> Floats:
        """The way from the flange along which the fingers point, shape (3,)."""
        return np.asarray(self.rotation[:, 2])

    @property
    def root(self) -> Floats:
        """Where the fingers begin, in the flange frame, shape (3,) [m]."""
        return np.asarray(self.position - 0.05 * self.direction)


@runtime_checkable
class Gripping(Protocol):
    """A plant with room for a gripper that really holds."""

    def mount(self, hand: Hand) -> None:
        """Mount a gripper, before the first reset."""

    def grip(self, opening: float, force: float) -> None:
        """Move the fingers from the next step on.

        Args:
            opening: Wanted distance between them [m].
            force: Largest force of each [N].
        """

    def opening(self) -> float:
        """Return the measured distance between the fingers [m]."""


@runtime_checkable
class Foreseeing(Protocol):
    """A plant that can tell what it would do if it were not moved any more."""

    def held(self) -> Callable[[int], Response]:
        """Keep the present state, which takes little time.

        Returns:
            What the arm would do in a number of periods if its drives held the position of the last command, without
            noise and without pushes from outside. It does not change the arm, and may be called at any later time.
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
        measured = plant.step(DriveCommand(*command))
        truth = plant.truth() if isinstance(plant, Truthful) else None
        if truth is None:
            raise ValueError(f"the plant {type(plant).__name__} does not provide the truth")
        own = (measured.q, measured.qd, measured.moment, measured.accelerometer)
        rows.append((*own, truth.specific_force, truth.flange_position, truth.flange_rotation))
    q, qd, moment, accelerometer, *felt = (np.array(column) for column in zip(*rows, strict=True))
    return Response(Measurement(q, qd, moment, accelerometer), *felt)

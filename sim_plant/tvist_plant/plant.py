"""Interface between a controller and a plant: drive commands in, measurements out, one control period at a time.

A plant is a `SimulatedArm`, which can be put anywhere, or a `RealArm`, which stands somewhere. All else that only some
arms can do has a default in `Plant`. A class that derives from neither but has the methods is a plant, too; see
`foreign.arm_of`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

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


class Plant(ABC):
    """An arm with its drives, simulated or real: all that a controller may ask of it.

    A controller owns its plant: no other code steps or resets it, and controllers do not share plants. When it starts,
    it places a `SimulatedArm`, and begins where a `RealArm` stands; from then on it calls `step` once in every control
    period of `PERIOD` seconds, with power or without. Every other method has a default, and `can` tells whether a plant
    has one of its own.

    An implementation guarantees:

    - n joints, as many as in the robot's description, in its order and with its signs and zeros;
    - that equal resets and equal commands give equal measurements to the last bit, if runs are to be replayed;
    - that returned arrays are not changed later, since they belong to the receiver;
    - that the command's arrays are neither kept nor changed;
    - that each call returns within the control period, if the clock is real time.
    """

    payload: Payload
    """Carried payload, as far as it is known; it determines how far the arm moves when the brakes close."""

    @abstractmethod
    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one control period.

        Args:
            command: Set-points for the end of the period; the drives go linearly from the previous ones to these.

        Returns:
            Measurements at the end of the period.

        Raises:
            PlantError: A simulated state is no longer finite, or a real arm does not answer. A simulated arm then is in
                a protective stop; a real one gets no power until the safety system is restarted.
        """

    def can(self, method: Callable[..., Any]) -> bool:
        """Return whether the plant has a method of its own for one that has a default here, such as `Plant.load`."""
        found = getattr(self, method.__name__)
        return callable(found) and getattr(found, "__func__", found) is not method

    # ------------------------------------------------------------------ what it carries and grips

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on, for the parts and tools of a cell; positions and velocities stay."""
        self._lacks("load")

    def mount(self, hand: Hand) -> None:
        """Mount a gripper that really holds, before the first reset."""
        self._lacks("mount")

    def grip(self, opening: float, force: float) -> None:
        """Move the fingers from the next step on.

        Args:
            opening: Wanted distance between them [m].
            force: Largest force of each [N].
        """
        self._lacks("grip")

    def opening(self) -> float:
        """Return the measured distance between the fingers [m]."""
        self._lacks("opening")

    # ------------------------------------------------------------------ power, and the tick

    @property
    def condition(self) -> Condition:
        """Its present condition. If it stops being ready while the robot runs, the robot stops."""
        return Condition(ready=True)

    def switch(self, *, power: bool, brakes: bool) -> None:
        """Ask for another state, which may take a while: `condition` tells when the drives hold the arm.

        Args:
            power: Whether the drives are to have power.
            brakes: Whether the brakes are to hold the arm.
        """

    def stop(self) -> None:
        """Stop with category 0, no power and brakes closed, for stops that do not go through the control line."""

    def wait(self, timeout: float) -> bool:
        """Give the tick: wait for the next control period; return False if it does not begin within the timeout [s]."""
        self._lacks("wait")

    @property
    def watched(self) -> bool:
        """Whether its own controller moves it, while we watch; see `RealArm.sight`."""
        return False

    @property
    def supervised(self) -> bool:
        """Whether we move it through its own controller; see `RealArm.seen`."""
        return False

    # ------------------------------------------------------------------ what only a simulation knows

    def truth(self) -> PlantTruth | None:
        """Return what a real robot cannot measure, after the last step or reset; None if that is unknown."""
        return None

    def modes(self, q: Floats | None = None) -> Modes | None:
        """Return the vibration modes of the closed loop at rest; None if they are unknown.

        Args:
            q: Joint positions, shape (n,) [rad]; None for the present ones.
        """
        return None

    def held(self) -> Callable[[int], Response]:
        """Keep the present state, which takes little time.

        Returns:
            What the arm would do in a number of periods if its drives held the position of the last command, without
            noise and without pushes from outside. It does not change the arm, and may be called at any later time.
        """
        self._lacks("held")

    def push(self, torque: Floats) -> None:
        """Apply external torques to the joints until they are changed or the arm is reset, for the fault `torque`.

        Args:
            torque: Torques on the link side, shape (n,); zeros end the push [N m].
        """
        self._lacks("push")

    def make_nan(self) -> None:
        """Make the state NaN for the fault `nan`, so that the next step raises `PlantError`."""
        self._lacks("make_nan")

    # ------------------------------------------------------------------ the world around it

    def things(self) -> Things | None:
        """Return what stands around it and touches it, which stays the same; None if nothing does."""
        return None

    def places(self) -> Floats:
        """Return the present poses of the bodies that move, in the frame of the base, shape (bodies, 6) [m, rad]."""
        return np.empty((0, 6))

    def contact(self) -> Floats:
        """Return the force of all that touches the arm, its tool or its fingers, base frame, shape (3,) [N]."""
        return np.zeros(3)

    def obstacle(self, q: Floats, payload: Payload | None) -> str | None:
        """Say what the arm would stand in after a reset; None if it would be clear. Asking changes nothing.

        Args:
            q: Joint angles of the reset, shape (n,) [rad].
            payload: New carried payload; None for the present one.
        """
        return None

    def _lacks(self, method: str) -> NoReturn:
        raise NotImplementedError(f"the plant {type(self).__name__} has no {method}")


class SimulatedArm(Plant):
    """A plant that can be put anywhere at rest: `simulation.reset` needs it."""

    @abstractmethod
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

    def play(self, commands: Floats) -> Response:
        """Move the arm by T control periods, with the same results to the last bit as one by one.

        Args:
            commands: Position, velocity and torque of the command for the end of each, shape (T, 3, n).

        Raises:
            PlantError: See `step`.
            ValueError: The plant does not provide the truth.
        """
        rows = []
        for command in commands:
            measured = self.step(DriveCommand(*command))
            truth = self.truth()
            if truth is None:
                raise ValueError(f"the plant {type(self).__name__} does not provide the truth")
            own = (measured.q, measured.qd, measured.moment, measured.accelerometer)
            rows.append((*own, truth.specific_force, truth.flange_position, truth.flange_rotation))
        q, qd, moment, accelerometer, *felt = (np.array(column) for column in zip(*rows, strict=True))
        return Response(Measurement(q, qd, moment, accelerometer), *felt)


class RealArm(Plant):
    """A plant that stands somewhere by itself.

    Its own controller may move it (`sight`), or follow our positions and stop it (`seen`); neither has a default.
    """

    def measure(self) -> Measurement:
        """Return the present measurements without moving the arm.

        Raises:
            PlantError: It does not answer. The robot then cannot begin with it, or does not switch its power on.
        """
        name = type(self).__name__
        raise ValueError(f"the plant {name} has neither reset nor measure: it needs one of them")

    @property
    def watched(self) -> bool:
        """Whether its own controller moves it: no command reaches it, and `step` only measures."""
        return self.can(RealArm.sight) and self.can(Plant.wait)

    @property
    def supervised(self) -> bool:
        """Whether we move it through its own controller, which follows our positions and may stop it."""
        needed = (RealArm.seen, RealArm.described, Plant.wait, Plant.switch, Plant.stop)
        return all(self.can(one) for one in needed)

    def sight(self) -> Sight:
        """Return what it said in its next cycle, for which `wait` has waited.

        Raises:
            PlantError: It has said nothing since the last call.
        """
        self._lacks("sight")

    def interval(self) -> float:
        """Return the time between two of its cycles as they arrive [s]."""
        return PERIOD

    def seen(self) -> Sight:
        """Return what it said last; its `told` are those since the last call."""
        self._lacks("seen")

    def described(self) -> RobotDescription:
        """Return the robot file with limits no wider than the robot's own."""
        self._lacks("described")

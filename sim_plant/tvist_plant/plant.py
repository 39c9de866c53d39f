"""Interface between a controller and a plant: drive commands in, measurements out, once per control period.

A plant is a `SimulatedArm`, which can be placed anywhere, or a `RealArm`, which cannot be placed. Abilities
of only some arms have a default in `Plant`. A class with the same methods that derives from neither also
works (`foreign.arm_of`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.modes import Modes
from tvist_plant.surroundings import Hand, Things

PERIOD = 0.002  # control period [s]
GRAVITY = 9.81  # gravitational acceleration, along the base's negative z axis [m/s²]


class PlantError(ArithmeticError):
    """A plant has failed: a simulated state is no longer finite, or a real arm does not answer."""


@dataclass(slots=True, eq=False)
class Measurement:
    """Measurements of a robot's own sensors.

    Not frozen, because creating a frozen one at every tick takes five times as long.
    """

    q: Floats  # link-side joint angles, shape (n,) [rad]
    qd: Floats  # link-side joint velocities, shape (n,) [rad/s]
    moment: Floats  # motor torques on the joint side, shape (n,) [N m]
    accelerometer: Floats  # specific force in the flange frame, with noise, shape (3,) [m/s^2]
    timestamp: float | None = None  # time of the measurement on the plant's clock; None if it has none [s]
    wrench: Floats | None = None
    """Force and torque about the flange's origin that everything beyond the force sensor exerts on the
    flange, in its frame, shape (6,) [N, N m]: weight, inertia and contact, with noise and offset. A push
    towards the flange reads along the push, as on UR robots. None: no such sensor."""


@dataclass(frozen=True)
class PlantTruth:
    """Quantities that a simulation knows and a real robot cannot measure."""

    motor_q: Floats  # motor angles on the joint side θ, shape (n,) [rad]
    motor_qd: Floats  # motor velocities on the joint side, shape (n,) [rad/s]
    gear_deflection: Floats  # q - θ, shape (n,) [rad]
    link_deflection: Floats
    """Angles of the links' virtual joints, about y and z of each; empty if links are rigid [rad]."""
    flange_position: Floats
    """Position of the flange in the world including deflections and tilt, shape (3,) [m]."""
    flange_rotation: Floats  # orientation of the flange, deflections included, shape (3, 3)
    specific_force: Floats  # specific force in the flange frame without noise, shape (3,) [m/s^2]
    static_gear_deflection: Floats | None = None
    """Part of `gear_deflection` that remains at rest in this pose, shape (n,); None: unknown [rad]."""
    static_link_deflection: Floats | None = None
    """Part of `link_deflection` that remains at rest in this pose; None: unknown [rad]."""


@dataclass(frozen=True)
class Response:
    """Results of T consecutive periods."""

    measured: Measurement  # measurements after each period, with arrays of shape (T, n) and (T, 3)
    specific_force: Floats  # specific force in the flange frame without noise, shape (T, 3) [m/s^2]
    flange_position: Floats  # position of the flange, shape (T, 3) [m]
    flange_rotation: Floats  # orientation of the flange, shape (T, 3, 3)


@dataclass(frozen=True)
class Halt:
    """A stop by the arm's own controller."""

    why: str  # the reason, and what to do before tvist can power on or unlock the arm
    safety_mode: int  # the arm's safety mode (RTDE number)


@dataclass(frozen=True)
class Condition:
    """State of a plant's drives as the plant reports it."""

    ready: bool  # whether the drives have power and the brakes are released
    fault: str | None = None  # description of a fault; None without one
    halt: Halt | None = None  # the stop by the arm's own controller; None if it has not stopped


@dataclass(frozen=True, slots=True, eq=False)
class RobotReport:
    """One cycle's report of a robot that its own controller moves."""

    tick: int  # number of the control period on the robot's clock, increasing
    measured: Measurement  # the robot's measurements
    target: Floats
    """The robot's target position [rad], velocity [rad/s], acceleration [rad/s²] and torque [N m], shape (4, n)."""
    modes: tuple[int, int, int]  # robot mode, safety mode and runtime state (RTDE numbers)
    speed: float  # fraction of the programmed speed [-]
    missed: int  # number of cycles lost since the first one
    payload: Payload | None = None  # payload set on the robot; None if not reported
    tool: tuple[float, ...] | None = None
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]; None if not reported."""
    force: tuple[float, ...] | None = None
    """Force and torque at the tool centre point, base frame [N, N m]; None if not reported."""
    slider: float | None = None  # position of the speed slider [-]; None if not reported
    inputs: int = 0  # digital inputs, bits in RTDE's order
    outputs: int = 0  # digital outputs, bits in RTDE's order
    told: tuple[str, ...] = ()  # messages for users


class Plant(ABC):
    """An arm with its drives, simulated or real, as a controller uses it.

    A controller owns its plant: no other code steps or resets it. On start the controller resets a `SimulatedArm`, or
    starts at the position of a `RealArm`. It then calls `step` once per control period (`PERIOD`), with or without
    power. All other methods have a default; `can` tells whether a plant overrides it.

    An implementation guarantees:

    - n joints, in the order and with the signs and zeros of the robot's description;
    - measurements equal to the last bit after equal resets and commands, if runs are to be replayed;
    - that it neither changes the arrays it returned nor keeps or changes the command's arrays;
    - that each call returns within the control period, if the clock is real time.
    """

    payload: Payload
    """Carried payload as far as known; it determines how far the arm moves while the brakes close."""

    @abstractmethod
    def step(self, command: DriveCommand) -> Measurement:
        """Move the arm by one control period.

        Args:
            command: Set-points for the end of the period; the drives interpolate linearly from the previous ones.

        Returns:
            Measurements at the end of the period.

        Raises:
            PlantError: A simulated state is no longer finite, or a real arm does not answer. A simulated arm then
                enters a protective stop; a real one stays without power until the safety system is restarted.
        """

    def can(self, method: Callable[..., Any]) -> bool:
        """Return whether the plant overrides a method that has a default here, such as `Plant.load`."""
        found = getattr(self, method.__name__)
        return callable(found) and getattr(found, "__func__", found) is not method

    def load(self, payload: Payload) -> None:
        """Carry another payload from now on; positions and velocities stay."""
        self._lacks("load")

    def mount(self, hand: Hand) -> None:
        """Mount a gripper with simulated grasping, before the first reset."""
        self._lacks("mount")

    def grip(self, opening: float, force: float) -> None:
        """Move the fingers from the next step on.

        Args:
            opening: Wanted distance between the fingers [m].
            force: Largest force of each finger [N].
        """
        self._lacks("grip")

    def opening(self) -> float:
        """Return the measured distance between the fingers [m]."""
        self._lacks("opening")

    @property
    def condition(self) -> Condition:
        """Present condition. If the drives stop being ready while the robot runs, the robot stops."""
        return Condition(ready=True)

    def switch(self, *, power: bool, brakes: bool) -> None:
        """Request another power state, which may take a while; `condition` reports when the drives are ready.

        Args:
            power: Whether the drives get power.
            brakes: Whether the brakes hold the arm.
        """

    def stop(self) -> None:
        """Stop with category 0 (power off, brakes closed), for stops that bypass the control line."""

    def wait(self, timeout: float) -> bool:
        """Wait for the plant's next control period; return False if none begins within the timeout [s]."""
        self._lacks("wait")

    @property
    def watched(self) -> bool:
        """True if the arm's own controller moves the arm and tvist only watches; see `RealArm.cycle_report`."""
        return False

    @property
    def supervised(self) -> bool:
        """True if tvist moves the arm through the arm's own controller; see `RealArm.latest_report`."""
        return False

    def truth(self) -> PlantTruth | None:
        """Return what a real robot cannot measure, after the last step or reset; None if unknown."""
        return None

    def modes(self, q: Floats | None = None) -> Modes | None:
        """Return the vibration modes of the closed loop at rest; None if unknown.

        Args:
            q: Joint positions, shape (n,) [rad]; None for the present ones.
        """
        return None

    def held(self) -> Callable[[int], Response]:
        """Save the present state, which is quick, for a later prediction.

        Returns:
            A function of a number of periods. It computes the arm's response if the drives hold the position
                of the last command, without noise or external pushes. It does not change the arm and may be
                called at any time.
        """
        self._lacks("held")

    def push(self, torque: Floats) -> None:
        """Apply external torques to the joints until changed or reset, for the fault `torque`.

        Args:
            torque: Torques on the link side, shape (n,); zeros end the push [N m].
        """
        self._lacks("push")

    def make_nan(self) -> None:
        """Make the state NaN for the fault `nan`; the next step then raises `PlantError`."""
        self._lacks("make_nan")

    def things(self) -> Things | None:
        """Return the objects around the arm, which do not change; None if there are none."""
        return None

    def places(self) -> Floats:
        """Return the present poses of the moving bodies in the base frame, shape (bodies, 6) [m, rad]."""
        return np.empty((0, 6))

    def contact(self) -> Floats:
        """Return the contact force on arm, tool and fingers together, base frame, shape (3,) [N]."""
        return np.zeros(3)

    def obstacle(self, q: Floats, payload: Payload | None) -> str | None:
        """Return what the arm would overlap if it were reset, None if nothing; the state does not change.

        Args:
            q: Joint angles of the reset, shape (n,) [rad].
            payload: New carried payload; None for the present one.
        """
        return None

    def _lacks(self, method: str) -> NoReturn:
        raise NotImplementedError(f"the plant {type(self).__name__} has no {method}")


class SimulatedArm(Plant):
    """A plant that can be placed anywhere at rest, as `simulation.reset` requires."""

    @abstractmethod
    def reset(self, command: DriveCommand, *, payload: Payload | None = None, seed: int = 0) -> Measurement:
        """Place the arm at rest under a command, as if it had stood there for a long time.

        Args:
            command: Position to hold, shape (n,) [rad], feed-forward torque [N m], and zero velocity.
            payload: New carried payload; None to keep the present one.
            seed: Seed of all random effects, such as sensor noise.

        Raises:
            ValueError: The arm cannot be placed there or cannot carry the payload, so its controller cannot
                start. After the start a plant must not raise this.
        """

    def play(self, commands: Floats) -> Response:
        """Move the arm by T control periods, with the results of `step` to the last bit.

        Args:
            commands: Position, velocity and torque for the end of each period, shape (T, 3, n).

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
    """Plant that cannot be placed. Its controller (`cycle_report`) or tvist (`latest_report`) moves it."""

    def measure(self) -> Measurement:
        """Return the present measurements without moving the arm.

        Raises:
            PlantError: The arm does not answer; the robot then cannot start, or does not power on.
        """
        raise ValueError(f"plant {type(self).__name__} has neither reset nor measure: give it one of them")

    @property
    def watched(self) -> bool:
        """Whether the arm's own controller moves the arm: commands have no effect; `step` only measures."""
        return self.can(RealArm.cycle_report) and self.can(Plant.wait)

    @property
    def supervised(self) -> bool:
        """Whether tvist moves the arm via the arm's own controller, which follows set-points and may stop."""
        needed = (RealArm.latest_report, RealArm.described, Plant.wait, Plant.switch, Plant.stop)
        return all(self.can(method) for method in needed)

    def cycle_report(self) -> RobotReport:
        """Return the report of the cycle that `wait` waited for.

        Raises:
            PlantError: There was no new report since the last call.
        """
        self._lacks("cycle_report")

    def interval(self) -> float:
        """Return the interval at which the arm's cycles arrive [s]."""
        return PERIOD

    def latest_report(self) -> RobotReport:
        """Return the latest report, with the messages (`told`) since the last call."""
        self._lacks("latest_report")

    def described(self) -> RobotDescription:
        """Return the robot file with limits no wider than the robot's own."""
        self._lacks("described")

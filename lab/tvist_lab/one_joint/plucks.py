"""The mode of the one-joint arm as it folds: by the formula, and as the simulated arm rings after a pluck."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import body, paper_payload
from tvist_lab.metrics import RingDown, fit_ring_down
from tvist_lab.one_joint.closed_form import FlexibleShoulder
from tvist_lab.recordings import Floats
from tvist_plant.description import Payload, RobotDescription, load
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD

ROBOT = "one-joint"
POSES = ("Q1", "Q2", "Q3")
"""Poses of the robot file whose elbow is at the angles of the paper's figure."""
MASSES = (0.0, 1.0)
"""Payloads of the figure [kg]."""
ANGLES = tuple(np.radians(np.arange(0.0, 151.0, 10.0)).tolist())
"""Elbow angles at which the arm is plucked [rad]."""
TORQUE = 2.0
"""Torque that twists the shoulder before it is let go [N m]."""
HELD = 1.0
"""Time for which it acts: the arm rests again before it is let go [s]."""
LISTENED = 1.0
"""Time that is recorded after that [s]."""
GRAVITY = (0.0, 0.0, 9.81)
"""What the accelerometer of an arm with vertical axes feels at rest [m/s²]."""


@dataclass(frozen=True)
class Plucked:
    """The mode at one angle of the elbow."""

    mass: float
    """Of the payload [kg]."""
    elbow: float
    """[rad]."""
    inertia: float
    """About the shoulder [kg m²]."""
    f_d: float
    """By the formula [Hz]."""
    zeta: float
    """[-]."""
    simulated_f_d: float
    """Fitted to the accelerometer after a pluck [Hz]."""
    simulated_zeta: float
    """[-]."""


@dataclass(frozen=True)
class Modes:
    """The modes of the one-joint arm over the angle of its elbow."""

    description: RobotDescription
    curve: tuple[Plucked, ...]
    """Over `ANGLES`, with each of `MASSES`."""
    poses: tuple[Plucked, ...]
    """At `POSES`, with the payload of the robot file."""

    @property
    def worst_f_d(self) -> float:
        """Largest deviation of the simulated f_d from the formula [%]."""
        return max(100.0 * abs(one.simulated_f_d / one.f_d - 1.0) for one in self.curve)

    @property
    def worst_zeta(self) -> float:
        """Largest deviation of the simulated ζ from the formula [%]."""
        return max(100.0 * abs(one.simulated_zeta / one.zeta - 1.0) for one in self.curve)


def pluck_all() -> Modes:
    """Pluck the arm all over its range."""
    description = load(ROBOT)
    curve = [plucked(description, mass, elbow) for mass in MASSES for elbow in ANGLES]
    carried = description.payload.mass
    poses = [plucked(description, carried, description.poses[name][1]) for name in POSES]
    return Modes(description, tuple(curve), tuple(poses))


def plucked(description: RobotDescription, mass: float, elbow: float) -> Plucked:
    """Mode by the formula, and as the simulated arm rings.

    Args:
        description: The one-joint arm.
        mass: Of the payload [kg].
        elbow: Angle of the elbow [rad].
    """
    payload = body(paper_payload(description, mass))
    formula = FlexibleShoulder.of(description, payload)
    f_d, zeta = formula.mode(elbow)
    ring = pluck(description, payload, elbow)
    return Plucked(mass, elbow, formula.inertia(elbow), f_d, zeta, ring.f_d, ring.zeta)


def pluck(description: RobotDescription, payload: Payload, elbow: float, seed: int = 0) -> RingDown:
    """Twist the shoulder, let it go, and fit a damped sine to what the accelerometer feels.

    The fit knows nothing of the arm: neither masses nor spring.

    Args:
        description: An arm with a shoulder and an elbow, about vertical axes.
        payload: What it carries.
        elbow: Angle of the elbow [rad].
        seed: Seed of sensor noise and gear errors.
    """
    plant = FlexibleArm(description, payload)
    still = DriveCommand(np.array([0.0, elbow]), np.zeros(2), np.zeros(2))
    plant.reset(still, seed=seed)
    plant.push(np.array([TORQUE, 0.0]))
    for _ in range(round(HELD / PERIOD)):
        plant.step(still)
    plant.push(np.zeros(2))
    felt: Floats = np.array([plant.step(still).accelerometer for _ in range(round(LISTENED / PERIOD))])
    return fit_ring_down(felt - GRAVITY, PERIOD)

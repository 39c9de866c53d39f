"""Pluck the simulated arm, and read frequency and damping off its accelerometer."""

import numpy as np

from tvist_lab.metrics import RingDown, fit_ring_down
from tvist_lab.recordings import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD

TORQUE = 2.0
"""Torque that twists the shoulder before it is let go [N m]."""
HELD = 1.0
"""Time for which it acts: the arm rests again before it is let go [s]."""
LISTENED = 1.0
"""Time that is recorded after that [s]."""
GRAVITY = (0.0, 0.0, 9.81)
"""What the accelerometer of an arm with vertical axes feels at rest [m/s²]."""


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

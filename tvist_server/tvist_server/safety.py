"""What the arm may do: positions, velocities, accelerations, torques."""

from dataclasses import dataclass

import numpy as np
from tvist_plant.description import RobotDescription

from tvist_server.control.differentiator import Floats, Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.trajectory import Stop

TORQUE_SHARE = 0.9
"""Share of the joints' torque that a stop may ask for [-]."""
GENTLEST_STOP = 1.0
"""Deceleration below which no stop goes, even where the torque then passes its share [rad/s^2]."""


@dataclass(frozen=True)
class StopPlan:
    """A stop and what limits it."""

    trajectory: Stop
    acceleration: float
    """Limit it keeps [rad/s^2]."""
    limited: bool
    """Whether that is less than was wanted."""


def plan_stop(
    description: RobotDescription,
    dynamics: InverseDynamics,
    state: Target,
    wanted: float | None,
    period: float,
) -> StopPlan:
    """The shortest stop whose torque stays within its share of the joints' limits.

    Gravity alone takes most of a stretched arm's torque, so the deceleration that is left depends on the pose: it is
    lowered in steps until the torque along the whole stop, by inverse dynamics of the rigid arm, is inside.

    Args:
        description: The robot.
        dynamics: Its inverse dynamics with the declared payload.
        state: Where the shaped reference is and how it moves.
        wanted: Deceleration asked for [rad/s^2]; None for as much as possible.
        period: Tick [s].
    """
    limits = description.limits
    highest = min(limits.acceleration)
    acceleration = highest if wanted is None else min(wanted, highest)
    torque = TORQUE_SHARE * np.array(limits.torque)
    lowered = wanted is not None and wanted > highest
    while True:
        trajectory = Stop(
            state.q, state.qd, state.qdd, acceleration=acceleration, jerk=min(limits.jerk), period=period
        )
        if acceleration <= GENTLEST_STOP or _within(trajectory, dynamics, torque):
            return StopPlan(trajectory, acceleration, lowered)
        acceleration = max(0.8 * acceleration, GENTLEST_STOP)
        lowered = wanted is not None


def _within(trajectory: Stop, dynamics: InverseDynamics, torque: Floats, samples: int = 12) -> bool:
    # The very start is what the motion already asks for: only what follows is the stop's own doing.
    times = np.linspace(0.0, trajectory.duration, samples + 1)[1:]
    return all(bool((np.abs(dynamics.torque(*trajectory.at(time))) <= torque).all()) for time in times)

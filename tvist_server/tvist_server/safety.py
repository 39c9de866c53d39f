"""What the arm may do: positions, velocities, accelerations, torques."""

from dataclasses import dataclass, replace

import numpy as np

from tvist_plant.description import RobotDescription
from tvist_server.control.differentiator import Floats, Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.trajectory import Stop

TORQUE_SHARE = 0.9
"""Share of the joints' torque that a stop or a stream may ask for [-]."""
GENTLEST_STOP = 1.0
"""Deceleration below which no stop goes: neither for torque, nor because a client wants it [rad/s^2]."""

REDUCED_SHARE = 0.25
"""Share of the joints' velocity that is left while the safety system reduces it [-]."""


class TorqueRoom:
    """What the joints' torques, less what gravity and velocities take, leave to a stream's accelerations.

    Args:
        description: The robot.
        dynamics: Its inverse dynamics with the declared payload.
    """

    def __init__(self, description: RobotDescription, dynamics: InverseDynamics) -> None:
        self._most = TORQUE_SHARE * np.array(description.limits.torque)
        self._dynamics = dynamics

    def allows(self, q: Floats, qd: Floats, qdd: Floats) -> bool:
        """Whether a state of motion keeps every torque within its share, or is as gentle as any stop."""
        if (self._dynamics.effort(q, qd, qdd) <= self._most).all():
            return True
        return bool(np.abs(qdd).max() <= GENTLEST_STOP)

    def acceleration(self, q: Floats, qd: Floats) -> float:
        """Largest a for which every q̈ with |q̈ᵢ| ≤ a keeps the torques within their share [rad/s^2].

        With τ = M q̈ + h, the most that such a q̈ asks of joint i is |hᵢ| + a Σⱼ|Mᵢⱼ|. No less than the gentlest stop.
        """
        left = self._most - self._dynamics.effort(q, qd, np.zeros_like(q))
        return max(float((left / np.abs(self._dynamics.inertia(q)).sum(axis=1)).min()), GENTLEST_STOP)


@dataclass(frozen=True)
class StopPlan:
    """A stop and what limits it."""

    trajectory: Stop
    acceleration: float
    """Limit it keeps [rad/s^2]."""
    limited: bool
    """Whether that is not what was wanted."""


def plan_stop(
    description: RobotDescription,
    dynamics: InverseDynamics,
    state: Target,
    wanted: float | None,
    period: float,
) -> StopPlan:
    """The shortest stop whose torque stays within its share of the joints' limits.

    Gravity alone takes most of a stretched arm's torque, so the deceleration left depends on the pose:
    it is lowered in steps until the torque along the whole stop, by inverse dynamics of the rigid arm, is
    inside. Where the motion already takes more, the stop may too. A stop so gentle that it would end beyond a
    joint's range is made as hard as one without a wish.

    Args:
        description: The robot.
        dynamics: Its inverse dynamics with the declared payload.
        state: Where the shaped reference is and how it moves.
        wanted: Deceleration asked for [rad/s^2]; None for as much as possible.
        period: Tick [s].
    """
    limits = description.limits
    highest = min(limits.acceleration)
    acceleration = highest if wanted is None else min(max(wanted, GENTLEST_STOP), highest)
    present = dynamics.effort(state.q, state.qd, state.qdd)
    torque = np.maximum(TORQUE_SHARE * np.array(limits.torque), present)
    while True:
        trajectory = Stop(
            state.q, state.qd, state.qdd, acceleration=acceleration, jerk=min(limits.jerk), period=period
        )
        if acceleration <= GENTLEST_STOP or _within(trajectory, dynamics, torque):
            break
        acceleration = max(0.8 * acceleration, GENTLEST_STOP)
    if wanted is not None and (np.abs(trajectory.at(trajectory.duration)[0]) > limits.position).any():
        hardest = plan_stop(description, dynamics, state, None, period)
        return replace(hardest, limited=True)
    return StopPlan(trajectory, acceleration, wanted is not None and acceleration != wanted)


def _within(trajectory: Stop, dynamics: InverseDynamics, torque: Floats) -> bool:
    # The very start is what the motion already asks for: only what follows is the stop's own doing. Forty-eight
    # moments, since torque peaks where a joint's ramp ends; widely spread ones first, which soon show an excess.
    times = np.linspace(0.0, trajectory.duration, 49)[1:].reshape(6, 8).T.ravel()
    return all(bool((dynamics.effort(*trajectory.at(time)) <= torque).all()) for time in times)

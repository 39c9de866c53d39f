"""What the arm may do: positions, velocities, accelerations, torques."""

import math
from bisect import bisect_left
from dataclasses import dataclass, replace

import numpy as np

from tvist_plant.description import RobotDescription
from tvist_server.control.differentiator import Floats, Target
from tvist_server.control.inverse_dynamics import InverseDynamics
from tvist_server.trajectory import Stop

TORQUE_SHARE = 0.9
"""Share of the joints' torque that a stop or a stream may ask for [-]."""
REBOUND = 1.0
"""How far a flexible arm's torque swings beyond a sudden change of the rigid arm's, against that change [-]: as far
again without damping. A stop bypasses the filter, so its change is sudden."""
GENTLEST_STOP = 1.0
"""Deceleration below which no stop goes: neither for torque, nor because a client wants it [rad/s^2]."""

STEP = 0.8
"""From one deceleration that is tried to the next [-]."""
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
    it is lowered by steps until the torque along the whole stop, by inverse dynamics of the rigid arm, is
    inside, and inside the limits themselves with what the flexible arm swings beyond it at both ends of the stop.
    Where the motion already takes more, the stop may too. A stop so gentle that it would end beyond a joint's
    range is made as hard as one without a wish.

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
    torque = _Room(dynamics, state, np.array(limits.torque))

    def stop(acceleration: float) -> Stop:
        return Stop(
            state.q, state.qd, state.qdd, acceleration=acceleration, jerk=min(limits.jerk), period=period
        )

    trajectory = stop(acceleration)
    if acceleration > GENTLEST_STOP and not torque.holds(trajectory):
        steps = math.ceil(math.log(acceleration / GENTLEST_STOP) / math.log(1.0 / STEP))
        ladder = [max(acceleration * STEP**step, GENTLEST_STOP) for step in range(1, steps + 1)]
        # Halve: what one step holds, a gentler one does; the gentlest of all need not be asked.
        rung = bisect_left(range(len(ladder) - 1), True, key=lambda k: torque.holds(stop(ladder[k])))
        acceleration = ladder[rung]
        trajectory = stop(acceleration)
    if wanted is not None and (np.abs(trajectory.at(trajectory.duration)[0]) > limits.position).any():
        hardest = plan_stop(description, dynamics, state, None, period)
        return replace(hardest, limited=True)
    return StopPlan(trajectory, acceleration, wanted is not None and acceleration != wanted)


class _Room:
    """What a stop may ask for.

    Args:
        dynamics: Inverse dynamics with the declared payload.
        state: Where it begins: where the motion already takes more, the stop may too.
        limits: Of the joints' torque, shape (n,) [N m].
    """

    def __init__(self, dynamics: InverseDynamics, state: Target, limits: Floats) -> None:
        self._dynamics = dynamics
        present = dynamics.effort(state.q, state.qd, state.qdd)
        self._share, self._most = np.maximum(TORQUE_SHARE * limits, present), np.maximum(limits, present)
        self._before = dynamics.torque(state.q, state.qd, state.qdd) - dynamics.gravity(state.q)

    def holds(self, trajectory: Stop) -> bool:
        """Whether a stop keeps to it.

        The very start is what the motion already asks for: only what follows is the stop's own doing. Thirty-two
        moments, since torque peaks where a joint's ramp ends; widely spread ones first, which soon show an excess.
        """
        times = np.linspace(0.0, trajectory.duration, 33)[1:].reshape(4, 8).T.ravel()
        return all(self._holds(*trajectory.at(time)) for time in times)

    def _holds(self, q: Floats, qd: Floats, qdd: Floats) -> bool:
        dynamics = self._dynamics
        torque, gravity = dynamics.torque(q, qd, qdd), dynamics.gravity(q)
        effort = dynamics.effort(q, qd, qdd) if dynamics.changing else np.abs(torque)
        if (effort > self._share).any():
            return False
        motion = torque - gravity
        begun = np.abs(torque + REBOUND * (motion - self._before))
        ended = np.abs(gravity - REBOUND * motion)
        return bool((np.maximum(begun, ended) <= self._most).all())

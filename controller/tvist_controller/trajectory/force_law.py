"""The law of force control: from the wrench that is felt to the velocity of the compliant axes."""

import math
from dataclasses import dataclass

import numpy as np

from tvist_controller.trajectory.limits import Floats

LEVER = 0.22
"""Length by which a turn of 1 rad counts as a way: virtual inertias and dampings are its square times those [m]."""
MASS = 70.0
"""Virtual mass M [kg]. M/D is the time constant that keeps what the arm's elasticity adds out of the loop."""
FREE_DAMPING = 2000.0
"""Damping in free space at a damping parameter of 1 [N s/m]."""
CONTACT_DAMPING = 1500.0
"""Least damping in contact, which the stiffest surface needs [N s/m]."""
CONTACT = 8.0
"""Force from which on an axis counts as being in contact, and torque times 1/`LEVER` [N]."""
RELEASE = 3.0, 3.0 / LEVER
"""Deceleration of an axis that is no longer compliant [m/s², rad/s²]."""


@dataclass(frozen=True)
class ForceTask:
    """What force control is to reach, by axes of its frame: three directions, then the turns about them."""

    compliant: Floats
    """1 for an axis along or about which the arm gives way, else 0, shape (6,)."""
    wrench: Floats
    """Force and torque that the arm exerts on its environment, shape (6,) [N, N m]."""
    limits: Floats
    """Largest speed of a compliant axis [m/s, rad/s], largest deviation of any other [m, rad], shape (6,)."""
    damping: float = 0.005
    """How quickly the arm slows down where nothing touches it, 0 (keeps its speed) to 1 [-]."""
    gain: float = 1.0
    """Factor of the difference between wanted and felt wrench, 0 to 2 [-]."""
    mass: float = MASS
    """Virtual mass [kg]."""
    contact_damping: float = CONTACT_DAMPING
    """Least damping of an axis in contact [N s/m]."""


def free_damping(parameter: float) -> float:
    """Damping of an axis that feels nothing, from the damping parameter, 0 to 1 [N s/m].

    The fourth root spreads the useful part of the range: 0.005 gives a quarter of the whole, 0 none.
    """
    return FREE_DAMPING * math.sqrt(math.sqrt(parameter))


def compliant_velocity(task: ForceTask, velocity: Floats, felt: Floats, period: float) -> Floats:
    """Velocity of the axes of the frame a tick later, shape (6,) [m/s, rad/s].

    Each compliant axis is a virtual mass with damping, M v̇ = g (w + f) - D v, with the wanted wrench w, the
    one f that is felt from the environment, shape (6,) [N, N m], and the gain g; it is integrated implicitly,
    so no damping is too large for a tick. Where a force is felt, D is at least that of contact. An axis that
    is not compliant loses the speed it had when it was.
    """
    scale = np.repeat([1.0, LEVER * LEVER], 3)
    touched = np.minimum(np.abs(felt) / np.repeat([CONTACT, CONTACT * LEVER], 3), 1.0)
    free = free_damping(task.damping)
    damping = free + max(task.contact_damping - free, 0.0) * touched
    push = task.gain * (task.wrench + felt) / (scale * task.mass)
    moved = (velocity + period * push) / (1.0 + period * damping / task.mass)
    moved = np.clip(moved, -task.limits, task.limits)
    most = period * np.repeat(RELEASE, 3)
    released = velocity - np.clip(velocity, -most, most)
    result: Floats = np.where(task.compliant > 0.0, moved, released)
    return result

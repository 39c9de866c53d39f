"""Friction of the joints as it was identified, to be fed forward at the speed of the motors (Stribeck)."""

import math

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats

LAWS = 5
"""Number of parameters of a joint: F_c [N m], F_s/F_c [-], v_s [rad/s], w [rad/s], F_v [N m s/rad]."""


@compiled_for_ticks
def friction_at(law: Floats, j: int, speed: float) -> float:
    """Return the friction of joint j at a speed: [F_c + (F_s - F_c) exp(-(v/v_s)²)] tanh(v/w) + F_v v [N m].

    Args:
        law: Parameters of each joint in the order of `LAWS`, shape (5, n).
        j: The joint.
        speed: v [rad/s].
    """
    slow = speed / law[2, j]
    coulomb = law[0, j] * (1.0 + (law[1, j] - 1.0) * math.exp(-slow * slow))
    friction: float = coulomb * math.tanh(speed / law[3, j]) + law[4, j] * speed
    return friction

"""Limits of a motion."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class MotionLimits:
    """Limits of each joint, or each entry of a path's parameter."""

    velocity: float
    """Velocity limit [rad/s]."""
    acceleration: float
    """Acceleration limit [rad/s^2]."""
    jerk: float
    """Jerk limit [rad/s^3]."""

"""Limits of a motion."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class MotionLimits:
    """One number each, for every joint or for a path's parameter."""

    velocity: float
    """[rad/s]."""
    acceleration: float
    """[rad/s^2]."""
    jerk: float
    """[rad/s^3]."""

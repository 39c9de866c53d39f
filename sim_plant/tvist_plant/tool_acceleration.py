"""The tool's acceleration without gravity, from an accelerometer's specific force."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tvist_plant.plant import GRAVITY


def tool_acceleration(force: ArrayLike, up: ArrayLike) -> NDArray[np.float64]:
    """Return α = f - g u [m/s²] from specific force f and the upward direction u in its axes, (..., 3)."""
    return np.asarray(force, dtype=np.float64) - GRAVITY * np.asarray(up)


def upward(rotation: ArrayLike) -> NDArray[np.float64]:
    """Return the upward direction Rᵀ z in frames given by rotation vectors, shape (..., 3) (Rodrigues)."""
    rotation = np.asarray(rotation, dtype=np.float64)
    angle: Any = np.linalg.norm(rotation, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        axis = np.where(angle > 0.0, rotation / angle, 0.0)
    z = np.array([0.0, 0.0, 1.0])
    return np.asarray(
        np.cos(angle) * z - np.sin(angle) * np.cross(axis, z) + (1.0 - np.cos(angle)) * axis[..., 2:] * axis
    )

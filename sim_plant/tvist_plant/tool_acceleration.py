"""α, the acceleration of the tool without gravity, from the specific force that an accelerometer feels."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tvist_plant.plant import GRAVITY


def tool_acceleration(force: ArrayLike, up: ArrayLike) -> NDArray[np.float64]:
    """α = f - g u, with f the specific force [m/s²] and u the upward direction in its axes, shape (..., 3) [m/s²]."""
    return np.asarray(force, dtype=np.float64) - GRAVITY * np.asarray(up)


def upward(rotation: ArrayLike) -> NDArray[np.float64]:
    """The upward direction Rᵀ z in frames with rotation vectors, both of shape (..., 3), by Rodrigues' formula."""
    rotation = np.asarray(rotation, dtype=np.float64)
    angle: Any = np.linalg.norm(rotation, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        axis = np.where(angle > 0.0, rotation / angle, 0.0)
    z = np.array([0.0, 0.0, 1.0])
    return np.asarray(
        np.cos(angle) * z - np.sin(angle) * np.cross(axis, z) + (1.0 - np.cos(angle)) * axis[..., 2:] * axis
    )

"""Axes of force mode, by its three types."""

from collections.abc import Callable
from typing import Literal

import numpy as np
import pinocchio as pin

from tvist_controller.line.differentiator import Floats

Feature = tuple[float, ...] | Literal["base", "tool"]
"""Pose of a frame in the base frame, x y z [m] and rotation vector [rad], or the frame of the base or of the tool."""
NEAR = 1e-3
"""Distance of the tool from the frame's origin, and speed, below which the axes stay as they are [m, m/s]."""


def frame_of(feature: Feature, kind: int) -> Callable[[tuple[Floats, Floats], Floats], Floats]:
    """Return the function that gives the axes of a task, as columns in the base frame, shape (3, 3).

    Its arguments are the tool's pose, as rotation matrix and position, and its velocity, shape (3,) [m/s].

    With kind 2 the axes stay as the frame's. With 1, the frame is turned so that its y axis points from the
    tool to the frame's origin; with 3, so that its x axis is the tool's velocity projected into its x-y
    plane.
    """
    if feature == "tool":
        return lambda pose, _: pose[0]
    axes, origin = np.eye(3), np.zeros(3)
    if not isinstance(feature, str):
        axes, origin = np.asarray(pin.exp3(np.array(feature[3:]))), np.array(feature[:3])
    if kind == 1:
        return lambda pose, _: _turned_to(axes, 1, origin - pose[1])
    if kind == 3:
        latest = [axes]

        def along(_: tuple[Floats, Floats], velocity: Floats) -> Floats:
            flat = velocity - axes[:, 2] * (axes[:, 2] @ velocity)
            if np.linalg.norm(flat) > NEAR:
                x = flat / np.linalg.norm(flat)
                latest[0] = np.column_stack((x, np.cross(axes[:, 2], x), axes[:, 2]))
            return latest[0]

        return along
    return lambda _pose, _velocity: axes


def _turned_to(axes: Floats, axis: int, direction: Floats) -> Floats:
    """Axes, of which one is turned into a direction by the shortest way."""
    length = np.linalg.norm(direction)
    if length < NEAR:
        return axes
    turned: Floats = (
        np.asarray(pin.Quaternion.FromTwoVectors(axes[:, axis], direction / length).matrix()) @ axes
    )
    return turned

"""Poses as rotation matrix and position, and as messages: x y z [m] and rotation vector [rad]."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from tvist_controller.trajectory.base import Floats


class Placement(NamedTuple):
    """A pose: rotation matrix, shape (3, 3), and position, shape (3,) [m]."""

    rotation: Floats
    position: Floats

    def __matmul__(self, other: "Placement") -> "Placement":
        return Placement(self.rotation @ other.rotation, self.rotation @ other.position + self.position)

    @property
    def inverse(self) -> "Placement":
        """Pose of the reference in this frame."""
        back = self.rotation.T
        return Placement(back, -back @ self.position)

    @property
    def vector(self) -> tuple[float, float, float, float, float, float]:
        """X y z [m] and rotation vector [rad]."""
        return placement_vector(*self)


def placement_vector(rotation: Floats, position: Floats) -> tuple[float, float, float, float, float, float]:
    """Return x y z [m] and rotation vector [rad] of a rotation matrix and a position."""
    x, y, z = position.tolist()
    rx, ry, rz = np.asarray(pin.log3(rotation)).tolist()
    return x, y, z, rx, ry, rz


def placement(pose: Sequence[float] | None) -> Placement:
    """Return the placement of a pose message; the identity for None."""
    if pose is None:
        return Placement(np.eye(3), np.zeros(3))
    return Placement(np.asarray(pin.exp3(np.array(pose[3:], dtype=float))), np.array(pose[:3], dtype=float))

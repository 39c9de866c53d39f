"""Objects of a scene around an arm, and the fingers of its gripper."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tvist_plant.model import Floats


@dataclass(frozen=True)
class Shape:
    """A primitive shape."""

    kind: str  # `plane`, `sphere`, `capsule`, `ellipsoid`, `cylinder` or `box`
    size: tuple[float, ...]
    """Size as in MuJoCo: radius and half length along z, or half lengths; 0 for an infinite side of a plane [m]."""
    pose: tuple[float, ...]  # pose in the body's frame: x y z [m] and rotation vector [rad]
    body: int | None  # number of the body that carries it; None if fixed in the arm's base frame
    colour: tuple[float, ...]  # red, green, blue and opacity, 0 to 1


@dataclass(frozen=True)
class Things:
    """The objects around an arm."""

    name: str  # name of the scene
    bodies: tuple[str, ...]  # names of the moving bodies
    shapes: tuple[Shape, ...]  # shapes of the moving bodies and of everything fixed
    areas: Mapping[str, Shape]  # named areas in which a test can check for a body
    unseen: int = 0  # number of shapes left out, such as meshes


@dataclass(frozen=True)
class Hand:
    """A gripper whose two fingers close along y of the tool centre point."""

    stroke: float  # distance between open fingers [m]
    position: Floats  # position of the tool centre point in the flange frame, shape (3,) [m]
    rotation: Floats  # orientation of the tool centre point in the flange frame, shape (3, 3)

    @property
    def direction(self) -> Floats:
        """Direction of the fingers, away from the flange, shape (3,)."""
        return np.asarray(self.rotation[:, 2])

    @property
    def root(self) -> Floats:
        """Root of the fingers in the flange frame, shape (3,) [m]."""
        return np.asarray(self.position - 0.05 * self.direction)

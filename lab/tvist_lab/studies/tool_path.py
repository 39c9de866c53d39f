"""Distance of a reference from the path of the tool, computed from densely sampled postures of the path."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tvist_lab.metrics.common_clock import Kinematics
from tvist_lab.recordings import Floats

PER_RADIAN = 0.25
"""Length that a turn of the tool counts as, as in the protocol [m/rad]."""
STEP = 1e-6
"""Step of the joints for derivatives [rad]."""


class ToolPath:
    """The path of the tool, as a chain of short straight lines on which the tool turns evenly.

    Args:
        kinematics: Pose of the tool at joint angles.
        q: Postures along the path, so close to each other that the tool's way between two of them is straight,
            shape (k, n) [rad].
    """

    def __init__(self, kinematics: Kinematics, q: Floats) -> None:
        self._kinematics = kinematics
        self._position, rotation = poses(kinematics, q)
        self._rotation = Rotation.from_matrix(rotation)
        self._near = cKDTree(self._position)

    @property
    def length(self) -> float:
        """Length of the path of the tool [m]."""
        return float(np.linalg.norm(np.diff(self._position, axis=0), axis=1).sum())

    def off(self, q: Floats) -> tuple[Floats, Floats]:
        """How far the tool is from its path.

        Args:
            q: Joint angles, shape (t, n) [rad].

        Returns:
            Distance from the nearest place of the path [m], and angle from the orientation there [rad], each of
            shape (t,).
        """
        position, matrix = poses(self._kinematics, q)
        rotation = Rotation.from_matrix(matrix)
        _, nearest = self._near.query(position)
        last = len(self._position) - 1
        found = [self._beside(np.clip(nearest + shift, 0, last - 1), position, rotation) for shift in (-1, 0)]
        first = found[0][0] <= found[1][0]
        return np.where(first, found[0][0], found[1][0]), np.where(first, found[0][1], found[1][1])

    def _beside(self, at: np.ndarray, position: Floats, rotation: Rotation) -> tuple[Floats, Floats]:
        """Distances and angles from one line of the chain for each posture."""
        start, way = self._position[at], self._position[at + 1] - self._position[at]
        along = np.einsum("ti,ti->t", position - start, way) / np.einsum("ti,ti->t", way, way)
        share = np.clip(along, 0.0, 1.0)[:, None]
        turn = (self._rotation[at + 1] * self._rotation[at].inv()).as_rotvec()
        there = Rotation.from_rotvec(share * turn) * self._rotation[at]
        distance = np.linalg.norm(position - start - share * way, axis=1)
        return distance, (rotation * there.inv()).magnitude()


def poses(kinematics: Kinematics, q: Floats) -> tuple[Floats, Floats]:
    """Positions, shape (k, 3) [m], and rotation matrices, shape (k, 3, 3), of the tool at postures of shape (k, n)."""
    found = [kinematics(posture) for posture in q]
    return np.array([position for position, _ in found]), np.array([rotation for _, rotation in found])


def jacobian(kinematics: Kinematics, q: Floats) -> Floats:
    """Derivatives of the tool's pose by the joint angles, with turns counted as lengths, shape (6, n) [m]."""
    columns = []
    for joint in range(len(q)):
        step = np.zeros_like(q)
        step[joint] = STEP
        (back, before), (ahead, after) = kinematics(q - step), kinematics(q + step)
        turn = Rotation.from_matrix(after @ before.T).as_rotvec()
        columns.append(np.concatenate((ahead - back, PER_RADIAN * turn)) / (2.0 * STEP))
    return np.array(columns).T

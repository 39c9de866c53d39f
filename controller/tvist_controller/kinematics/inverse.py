"""Inverse kinematics: joint positions for a pose of the flange."""

from typing import Literal

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.choice import (
    FOUND,
    NO_SOLUTION,
    ON_CURVE,
    closest,
    search,
)
from tvist_controller.kinematics.postures import ANY, arm_table
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats

STARTS = 63  # number of further start postures for an arm without closed form


class InverseKinematicsError(ValueError):
    """No joint positions reach the pose.

    Attributes:
        code: "no_solution", or "limit_position" if every solution is outside a joint's range.
        limit: Position limit of that joint [rad]; None for "no_solution".
    """

    def __init__(self, message: str, limit: float | None = None) -> None:
        super().__init__(message)
        self.code: Literal["no_solution", "limit_position"]
        self.code, self.limit = "no_solution" if limit is None else "limit_position", limit


class InverseKinematics:
    """Nearest posture with a given pose of the flange.

    UR arms and arms with a spherical wrist have a closed form (`postures`). Others are solved by damped least
    squares from 64 fixed starts, which may miss a posture.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._names = description.robot.joints
        self._arm, self._chain = arm_table(description), Arm(description).chain
        self._limits = self._arm[:-1, 4]
        self._closed = bool(self._arm[-1, 0] != ANY)
        span = np.minimum(self._limits, np.pi)
        self.searched = not self._closed
        """Whether the last `solve` searched a curve of postures, or had no closed form."""
        self._starts = np.random.default_rng(1).uniform(-span, span, (STARTS, description.joints))

    def solve(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        """Return the posture nearest to `near` (Euclidean, in joint space) with this pose of the flange.

        Each joint's turn count is the nearest in its range. If sin q₅ = 0 or another joint is free, the
        nearest posture of that curve is returned. The pose is accurate to 1e-9 m and 1e-9 rad. Raise
        InverseKinematicsError if no posture is in range.
        """
        # Same memory layout, so that kernels are compiled only once.
        rotation, position, near = (np.array(given, float, order="C") for given in (rotation, position, near))
        if not self._closed:
            return self._search(rotation, position, near)
        q = near.copy()
        status = closest(self._arm, self._chain, rotation, position, near, q)
        self.searched = status >= ON_CURVE
        status %= ON_CURVE
        if status != FOUND:
            raise self._error(None if status == NO_SOLUTION else q)
        return q

    def _search(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        found = np.empty((2 * STARTS + 2, len(near)))
        best = search(self._arm, self._chain, self._starts, rotation, position, near, found)
        if best >= 0:
            return np.array(found[best])
        found = found[~np.isnan(found[:, 0])]
        raise self._error(found[np.argmin(np.linalg.norm(found - near, axis=1))] if len(found) else None)

    def _error(self, q: Floats | None) -> InverseKinematicsError:
        """Return the error for no posture, or for the joint farthest outside its range."""
        if q is None:
            return InverseKinematicsError("no joint positions reach this pose")
        joint = int(np.argmax(np.abs(q) - self._limits))
        value, limit = float(q[joint]), float(self._limits[joint])
        why = f"{self._names[joint]} would be at {value:.4f} rad, outside its range of ±{limit:.4f} rad"
        return InverseKinematicsError(why, limit)

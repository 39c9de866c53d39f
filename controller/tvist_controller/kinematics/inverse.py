"""Inverse kinematics: joint positions from a pose of the flange."""

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

STARTS = 63
"""Postures, besides the given one, from which an arm without closed form is searched."""


class InverseKinematicsError(ValueError):
    """No joint positions reach the pose.

    Attributes:
        code: "no_solution" if no posture has this pose; "limit_position" if every posture that has it is outside a
            joint's range.
        limit: Largest distance of that joint from zero [rad]; None without solution.
    """

    def __init__(self, message: str, limit: float | None = None) -> None:
        super().__init__(message)
        self.code: Literal["no_solution", "limit_position"]
        self.code, self.limit = "no_solution" if limit is None else "limit_position", limit


class InverseKinematics:
    """The nearest of all postures of an arm that have a pose of the flange.

    UR arms, and arms with a spherical wrist, are solved in closed form (`postures`), others by damped least squares
    from 64 starts, which are the same for every call. There, a posture that no start leads to is missed.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._names = description.robot.joints
        self._arm, self._chain = arm_table(description), Arm(description).chain
        self._limits = self._arm[:-1, 4]
        self._closed = bool(self._arm[-1, 0] != ANY)
        span = np.minimum(self._limits, np.pi)
        self.searched = not self._closed
        """Whether the last call of `solve` had to search a curve of postures, or without a closed form."""
        self._starts = np.random.default_rng(1).uniform(-span, span, (STARTS, description.joints))

    def solve(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        """Return the posture nearest to another one, of all that have a pose of the flange.

        Nearest means the smallest Euclidean distance in joint space. Each joint has the representation, of
        those that differ by whole turns and are in its range, that is nearest. If sin q₅ = 0, or if another
        joint is free at the pose, the nearest posture of the curve of them is returned. Its pose differs by
        at most 1e-9 m and 1e-9 rad.

        Raises:
            InverseKinematicsError: No posture within the joints' ranges has this pose.
        """
        # Of one layout, so that the kernels are compiled once.
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
        """Say that there is no posture, or which joint of the nearest one is outside its range most."""
        if q is None:
            return InverseKinematicsError("no joint positions reach this pose")
        joint = int(np.argmax(np.abs(q) - self._limits))
        value, limit = float(q[joint]), float(self._limits[joint])
        why = f"{self._names[joint]} would be at {value:.4f} rad, outside its range of ±{limit:.4f} rad"
        return InverseKinematicsError(why, limit)

"""Inverse kinematics: joint positions from a pose of the flange."""

from typing import Literal

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.choice import (
    FOUND,
    NO_SOLUTION,
    ON_CURVE,
    closest,
    improved_postures,
    search,
)
from tvist_controller.kinematics.geometry import ANY, arm_table
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats

STARTS = 63
"""Postures, besides the given one, from which an arm without closed form is searched."""

SAME = 1e-6
"""Difference of angles [rad] below which two postures count as one."""


class InverseKinematicsError(ValueError):
    """No joint positions reach the pose.

    Attributes:
        code: "no_solution" if no posture has this pose; "limit_position" if every posture that has it is outside a
            joint's range.
        joint: Index of the joint whose range is exceeded most, in the nearest posture; None without solution.
        value: Position of that joint, in its representation nearest to zero [rad]; None without solution.
        limit: Its largest distance from zero [rad]; None without solution.
    """

    def __init__(
        self,
        message: str,
        code: Literal["no_solution", "limit_position"] = "no_solution",
        joint: int | None = None,
        value: float | None = None,
        limit: float | None = None,
    ) -> None:
        super().__init__(message)
        self.code: Literal["no_solution", "limit_position"] = code
        self.joint = joint
        self.value = value
        self.limit = limit


class InverseKinematics:
    """All postures of an arm that have a pose of the flange, and the nearest of them.

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
            raise self._none() if status == NO_SOLUTION else self._outside(q)
        return q

    def all(self, rotation: Floats, position: Floats) -> Floats:
        """Return the distinct postures that have a pose, whatever the joints' ranges, shape (k, n).

        Each angle is within ±π [rad]; postures that differ by less than 1e-6 rad are one. Where a joint is
        free, the postures next to zero stand for the curves of postures. For a redundant arm, the postures
        are examples.
        """
        zero = np.zeros(len(self._limits))
        unlimited = self._arm.copy()
        unlimited[:-1, 4] = 2.0 * np.pi
        if self._closed:
            found = np.empty((8, 6))
            improved_postures(unlimited, self._chain, rotation, position, zero, found)
        else:
            found = np.empty((2 * STARTS + 2, len(zero)))
            search(unlimited, self._chain, self._starts, rotation, position, zero, found)
        return _distinct(found[~np.isnan(found[:, 0])])

    def _search(self, rotation: Floats, position: Floats, near: Floats) -> Floats:
        found = np.empty((2 * STARTS + 2, len(near)))
        best = search(self._arm, self._chain, self._starts, rotation, position, near, found)
        if best >= 0:
            return np.array(found[best])
        found = found[~np.isnan(found[:, 0])]
        if not len(found):
            raise self._none()
        raise self._outside(found[np.argmin(np.linalg.norm(found - near, axis=1))])

    def _none(self) -> InverseKinematicsError:
        return InverseKinematicsError("no joint positions reach this pose")

    def _outside(self, q: Floats) -> InverseKinematicsError:
        joint = int(np.argmax(np.abs(q) - self._limits))
        value, limit = float(q[joint]), float(self._limits[joint])
        return InverseKinematicsError(
            f"{self._names[joint]} would be at {value:.4f} rad, outside its range of ±{limit:.4f} rad",
            "limit_position",
            joint,
            value,
            limit,
        )


def _distinct(found: Floats) -> Floats:
    """Keep the first of each group of postures that are the same but for whole turns."""
    kept: list[Floats] = []
    for q in found:
        differences = [np.abs(np.remainder(q - other + np.pi, 2.0 * np.pi) - np.pi).max() for other in kept]
        if not differences or min(differences) > SAME:
            kept.append(q)
    return np.array(kept).reshape(len(kept), found.shape[1])

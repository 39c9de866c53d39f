"""Pose and Jacobian of the tool centre point, for motions of the tool."""

from collections.abc import Sequence
from typing import Self

import numpy as np
import pinocchio as pin

from tvist_controller.kinematics.denavit_hartenberg import Floats, bias, dh_table, kinematics
from tvist_controller.kinematics.straight_step import pseudo_inverse, straight_step
from tvist_plant.description import RobotDescription


def turn(start: Floats, end: Floats) -> Floats:
    """Return the rotation vector in the base frame that turns one orientation into another, by the shortest way.

    Args:
        start: Rotation matrix, shape (3, 3).
        end: Rotation matrix, shape (3, 3).

    Returns:
        Rotation vector, shape (3,) [rad].
    """
    vector: Floats = np.asarray(pin.log3(end @ start.T))
    return vector


def turned(rotation: Floats, angle: Floats) -> Floats:
    """Return a rotation matrix turned about the base frame's axes by a rotation vector, shape (3,) [rad]."""
    result: Floats = np.asarray(pin.exp3(angle)) @ rotation
    return result


class ToolKinematics:
    """Kinematics of the rigid arm's tool centre point in the base frame.

    Args:
        description: The robot.
        tcp: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
    """

    def __init__(self, description: RobotDescription, tcp: Sequence[float] = (0.0,) * 6) -> None:
        self._description = description
        self._dh = dh_table(description)
        self._tool = np.asarray(pin.exp3(np.array(tcp[3:], dtype=float))), np.array(tcp[:3], dtype=float)

    def with_tool(self, tcp: Sequence[float]) -> Self:
        """Return the kinematics of another tool on the same arm."""
        return type(self)(self._description, tcp)

    turn, turned = staticmethod(turn), staticmethod(turned)

    def pose(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the rotation matrix, shape (3, 3), and the position, shape (3,) [m]."""
        rotation, position, _ = kinematics(self._dh, *self._tool, q)
        return rotation, position

    def jacobian(self, q: Floats) -> Floats:
        """Return the Jacobian of velocity [m/s] and angular velocity [rad/s], shape (6, n)."""
        return kinematics(self._dh, *self._tool, q)[2]

    def all(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Return rotation matrix, position and Jacobian."""
        return kinematics(self._dh, *self._tool, q)

    def bias(self, q: Floats, qd: Floats) -> Floats:
        """Return the tool's acceleration at constant velocities of the joints, J̇ q̇, shape (6,)."""
        return bias(self._dh, self._tool[1], q, qd)

    def inverse(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the Jacobian, and its pseudo-inverse without the directions that are lost, shape (n, 6)."""
        jacobian, inverse = self.jacobian(q), np.empty((len(q), 6))
        pseudo_inverse(jacobian, inverse)
        return jacobian, inverse

    def rehearse(self, period: float) -> None:
        """Compile what `straight` uses, or load it from disk, before a tick needs it."""
        n = len(self._dh)
        still, at = np.zeros((3, n)), self.pose(np.zeros(n))
        inverse = self.inverse(still[0])[1]
        self.straight(
            inverse, still[:2], np.zeros((2, 6)), still, np.zeros(6), 1.0, 1.0, 1.0, 1.0, period, at
        )

    def straight(
        self, inverse: Floats, joints: Floats, twists: Floats, ranges: Floats, change: Floats,
        rate: float, speed: float, slowest: float, acceleration: float, period: float,
        place: tuple[Floats, Floats],
    ) -> tuple[int, float, Floats, tuple[Floats, Floats]]:  # fmt: skip
        """Follow a straight way for a tick, see `straight_step`; return also the tool's rotation and position then."""
        q, rotation, position = np.empty(len(inverse)), np.empty((3, 3)), np.empty(3)
        status, new = straight_step(
            self._dh, *self._tool, inverse, joints, twists, ranges, change, rate, speed, slowest, acceleration, period,
            *place, rotation, position, q,
        )  # fmt: skip
        return status, new, q, (rotation, position)

"""Pose and Jacobian of the tool centre point, for motions of the tool."""

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np
import pinocchio as pin

from tvist_controller.control.differentiator import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model


class ToolKinematics:
    """Kinematics of the rigid arm's tool centre point, which is the flange until `with_tool` changes it.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._model = rigid_model(description, Payload())
        self._data = self._model.createData()
        self._flange = self._model.getFrameId(FLANGE)
        self._tool = pin.SE3.Identity()

    def with_tool(self, offset: Sequence[float]) -> Self:
        """Return the kinematics of another tool on the same arm.

        Args:
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        other = copy.copy(self)
        other._tool = pin.SE3(pin.exp3(np.array(offset[3:])), np.array(offset[:3]))  # noqa: SLF001  one of its own kind
        return other

    def pose(self, q: Floats) -> tuple[Floats, Floats]:
        """Return the rotation matrix, shape (3, 3), and the position, shape (3,) [m], in the base frame."""
        pin.forwardKinematics(self._model, self._data, q)
        placement = pin.updateFramePlacement(self._model, self._data, self._flange) * self._tool
        return placement.rotation.copy(), placement.translation.copy()

    def jacobian(self, q: Floats) -> Floats:
        """Return the Jacobian of velocity [m/s] and angular velocity [rad/s] in the base frame, shape (6, n)."""
        frame = pin.LOCAL_WORLD_ALIGNED
        found = np.array(pin.computeFrameJacobian(self._model, self._data, q, self._flange, frame))
        lever = self._data.oMf[self._flange].rotation @ self._tool.translation
        found[:3] -= pin.skew(lever) @ found[3:]
        return found

    def turned(self, rotation: Floats, angle: Floats) -> Floats:
        """Return a rotation matrix turned about the base frame's axes by a rotation vector, shape (3,) [rad]."""
        return np.array(pin.exp3(angle) @ rotation)

    def turn(self, start: Floats, end: Floats) -> Floats:
        """Return the rotation vector that turns one rotation matrix into another, shape (3,) [rad]."""
        return np.array(pin.log3(end @ start.T))

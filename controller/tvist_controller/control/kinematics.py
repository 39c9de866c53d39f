"""Forward kinematics: pose and velocity of the tool from joint angles."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from tvist_controller.control.differentiator import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model


class ForwardKinematics:
    """Pose and speed of the rigid arm's tool centre point, which is the flange until `set_tool` changes it.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._model = rigid_model(description, Payload())
        self._data = self._model.createData()
        self._flange = self._model.getFrameId(FLANGE)
        self._tool: pin.SE3 | None = None

    def set_tool(self, offset: Sequence[float]) -> None:
        """Set the tool centre point in the flange frame: x y z [m] and rotation vector [rad]."""
        self._tool = None
        if any(offset):
            self._tool = pin.SE3(pin.exp3(np.array(offset[3:])), np.array(offset[:3]))

    def tool(self, q: Floats, qd: Floats) -> tuple[list[float], list[float]]:
        """Return pose and speed in the base frame.

        Args:
            q: Joint positions, shape (n,) [rad].
            qd: Joint velocities, shape (n,) [rad/s].

        Returns:
            x y z [m] and rotation vector [rad]; linear [m/s] and angular [rad/s] velocity.
        """
        pin.forwardKinematics(self._model, self._data, q, qd)
        placement = pin.updateFramePlacement(self._model, self._data, self._flange)
        velocity = pin.getFrameVelocity(self._model, self._data, self._flange, pin.LOCAL_WORLD_ALIGNED)
        if self._tool is not None:
            lever = placement.rotation @ self._tool.translation
            velocity.linear = velocity.linear + np.cross(velocity.angular, lever)
            placement = placement * self._tool
        pose = placement.translation.tolist() + pin.log3(placement.rotation).tolist()
        return pose, velocity.vector.tolist()


def rotation_vector(rotation: Floats) -> list[float]:
    """Convert a rotation matrix, shape (3, 3), to a rotation vector [rad]."""
    return list(np.asarray(pin.log3(rotation)).tolist())

"""Torques that the rigid arm needs for a motion."""

import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import rigid_model
from tvist_server.control.differentiator import Floats


class InverseDynamics:
    """Recursive Newton-Euler on the rigid model with the payload that was declared.

    Args:
        description: The robot.
        payload: What the controller believes the arm carries.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self.payload = payload
        self._model = rigid_model(description, payload)
        self._data = self._model.createData()

    def torque(self, q: Floats, qd: Floats, qdd: Floats) -> Floats:
        """τ = M(q) q̈ + C(q, q̇) q̇ + g(q), shape (n,) [N m]."""
        return np.array(pin.rnea(self._model, self._data, q, qd, qdd))

    def gravity(self, q: Floats) -> Floats:
        """g(q), shape (n,) [N m]."""
        return np.array(pin.computeGeneralizedGravity(self._model, self._data, q))

"""Mechanics of the rigid arm with the declared payload, as the instruments need them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import FLANGE, Floats, payload_inertia, rigid_model
from tvist_protocol.values import Payload

ELBOW = 2
"""Index of the joint whose axis is the elbow."""


@dataclass(frozen=True)
class Tool:
    """Motion of the tool centre point in the base frame."""

    pose: list[float]
    """x y z [m] and rotation vector [rad]."""
    speed: list[float]
    """Linear [m/s] and angular [rad/s] velocity."""
    acceleration: list[float]
    """Linear [m/s²] and angular [rad/s²] acceleration."""


def add(a: list[float], b: list[float]) -> list[float]:
    """Sum of two vectors as lists; for three numbers, numpy takes ten times as long."""
    return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]


def cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """Cross product a × b, also as lists."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def carried(omega: list[float], alpha: list[float], arm: list[float]) -> list[float]:
    """Acceleration of one point of a body relative to another, α × r + ω × (ω × r) [m/s²].

    Args:
        omega: Angular velocity [rad/s].
        alpha: Angular acceleration [rad/s²].
        arm: r, from the other point to this one [m].
    """
    return add(cross(alpha, arm), cross(omega, cross(omega, arm)))


class RigidBody:
    """The arm as the controller models it.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._model = rigid_model(description, Body())
        self._data = self._model.createData()
        self._flange = self._model.getFrameId(FLANGE)
        frame = self._model.frames[self._flange]
        self._last, self._placement = frame.parentJoint, frame.placement
        self._bare = self._model.inertias[self._last].copy()
        self._payload: Payload | None = None
        self._elbow = ELBOW + 1 if description.joints > ELBOW else 0

    def tool(self, q: list[float], qd: list[float], qdd: list[float], offset: list[float]) -> Tool:
        """Compute the motion of the tool centre point.

        Args:
            q: Joint positions [rad].
            qd: Joint velocities [rad/s].
            qdd: Joint accelerations [rad/s²].
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        model, data, flange = self._model, self._data, self._flange
        pin.forwardKinematics(model, data, np.array(q), np.array(qd), np.array(qdd))
        placement = pin.updateFramePlacement(model, data, flange)
        velocity = pin.getFrameVelocity(model, data, flange, pin.LOCAL_WORLD_ALIGNED)
        acceleration = pin.getFrameClassicalAcceleration(model, data, flange, pin.LOCAL_WORLD_ALIGNED)
        position, rotation = placement.translation.tolist(), placement.rotation
        linear, linear_rate = velocity.linear.tolist(), acceleration.linear.tolist()
        omega, alpha = velocity.angular.tolist(), acceleration.angular.tolist()
        if any(offset):
            arm = (rotation @ np.array(offset[:3])).tolist()
            rotation = rotation @ pin.exp3(np.array(offset[3:]))
            position, linear = add(position, arm), add(linear, cross(omega, arm))
            linear_rate = add(linear_rate, carried(omega, alpha, arm))
        return Tool(
            pose=position + pin.log3(rotation).tolist(),
            speed=linear + omega,
            acceleration=linear_rate + alpha,
        )

    def flange_rotation(self, q: list[float]) -> Floats:
        """Rotation from the flange to the base frame, shape (3, 3)."""
        pin.framesForwardKinematics(self._model, self._data, np.array(q))
        return np.array(self._data.oMf[self._flange].rotation)

    def elbow(self, q: list[float], qd: list[float]) -> tuple[list[float], list[float]]:
        """Position [m] and velocity [m/s] of the elbow's axis, or of the flange if the arm has no elbow."""
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, np.array(q), np.array(qd))
        if self._elbow:
            velocity = pin.getVelocity(model, data, self._elbow, pin.LOCAL_WORLD_ALIGNED)
            return data.oMi[self._elbow].translation.tolist(), velocity.linear.tolist()
        placement = pin.updateFramePlacement(model, data, self._flange)
        velocity = pin.getFrameVelocity(model, data, self._flange, pin.LOCAL_WORLD_ALIGNED)
        return placement.translation.tolist(), velocity.linear.tolist()

    def momentum(self, q: list[float], qd: list[float], payload: Payload) -> float:
        """Magnitude of the momentum of the links and the payload, |Σ m v| [kg m/s]."""
        self._load(payload)
        momentum = pin.computeCentroidalMomentum(self._model, self._data, np.array(q), np.array(qd))
        return hypot(*momentum.linear.tolist())

    def moment(self, q: list[float], qd: list[float], qdd: list[float], payload: Payload) -> list[float]:
        """Torques that a motion needs, one for each joint [N m]."""
        self._load(payload)
        torque: list[float] = pin.rnea(
            self._model, self._data, np.array(q), np.array(qd), np.array(qdd)
        ).tolist()
        return torque

    def base_wrench(self, q: list[float], qd: list[float], qdd: list[float], payload: Payload) -> list[float]:
        """Force [N] and torque [N m] of the arm on its base, base frame; without the base's own weight."""
        self._load(payload)
        pin.rnea(self._model, self._data, np.array(q), np.array(qd), np.array(qdd))
        wrench = -self._data.oMi[1].act(self._data.f[1]).vector
        return [float(value) for value in wrench]

    def _load(self, payload: Payload) -> None:
        """Attach a payload to the last link."""
        if payload is self._payload or payload == self._payload:
            return
        self._payload, inertia = payload, self._bare
        if payload.mass > 0.0:
            body = Body(mass=payload.mass, com=payload.com, inertia=payload.inertia)
            inertia = self._bare + self._placement.act(payload_inertia(body))
        self._model.inertias[self._last] = inertia

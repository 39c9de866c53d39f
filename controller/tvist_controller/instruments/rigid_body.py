"""Mechanics of the rigid arm with the declared payload, as the instruments need them."""

from collections.abc import Sequence
from math import hypot

import numpy as np
import pinocchio as pin

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.kinematics import tool_motion
from tvist_plant.chain import SCRATCH, chain_of, sweep
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import FLANGE, Floats, payload_inertia, rigid_model
from tvist_protocol.values import Payload

ELBOW = 2
"""Index of the joint whose axis is the elbow."""


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


@compiled_for_ticks
def tool_rates(chain: Floats, tool: Floats, q: Floats, qd: Floats, qdd: Floats, out: Floats) -> None:
    """Compute the motion of a point that is fixed to the end of a chain; the first twelve are those of `tool_motion`.

    Args:
        chain: The links, see `tvist_plant.chain`, shape (n+1, 22).
        tool: See `tool_motion`, shape (12,).
        q: Joint positions, shape (n,) [rad].
        qd: Joint velocities, shape (n,) [rad/s].
        qdd: Joint accelerations, shape (n,) [rad/s^2].
        out: Result: position [m], rotation vector [rad], velocities and accelerations, each linear and angular, shape
            (18,).
    """
    n = q.shape[0]
    tool_motion(chain, tool, q, qd, out[:12])
    bodies = np.empty((n + 1, SCRATCH))
    sweep(chain, q, qd, qdd, 0.0, bodies)
    A, V, P = bodies[n, 22:28], bodies[n, 16:22], out[:3]
    u, v, w = out[6], out[7], out[8]
    out[12] = A[3] + A[1] * P[2] - A[2] * P[1] + V[1] * w - V[2] * v
    out[13] = A[4] + A[2] * P[0] - A[0] * P[2] + V[2] * u - V[0] * w
    out[14] = A[5] + A[0] * P[1] - A[1] * P[0] + V[0] * v - V[1] * u
    for k in range(3):
        out[15 + k] = A[k]


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
        self._chain = chain_of(self._model, self._flange)
        self._offset: list[float] = []
        self._tool = np.zeros(12)
        self._elbow = ELBOW + 1 if description.joints > ELBOW else 0
        self.tool(np.zeros((3, description.joints)), [0.0] * 6)  # loads compiled code, which takes many ticks

    def tool(self, motion: Floats, offset: list[float]) -> Floats:
        """Return the motion of the tool centre point in the base frame, shape (18,).

        Its pose, x y z [m] and rotation vector [rad]; its velocity, linear [m/s] and angular [rad/s]; its acceleration,
        linear [m/s²] and angular [rad/s²].

        Args:
            motion: Joint positions [rad], velocities [rad/s] and accelerations [rad/s²], shape (3, n).
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        if offset != self._offset:
            turned = pin.exp3(np.array(offset[3:])).ravel()
            self._offset, self._tool = list(offset), np.concatenate([turned, offset[:3]])
        out = np.empty(18)
        tool_rates(self._chain, self._tool, motion[0], motion[1], motion[2], out)
        return out

    def flange_rotation(self, q: Floats) -> Floats:
        """Rotation from the flange to the base frame, shape (3, 3)."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array(self._data.oMf[self._flange].rotation)

    def elbow(self, q: Floats, qd: Floats) -> tuple[list[float], list[float]]:
        """Position [m] and velocity [m/s] of the elbow's axis, or of the flange if the arm has no elbow."""
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, q, qd)
        if self._elbow:
            velocity = pin.getVelocity(model, data, self._elbow, pin.LOCAL_WORLD_ALIGNED)
            return data.oMi[self._elbow].translation.tolist(), velocity.linear.tolist()
        placement = pin.updateFramePlacement(model, data, self._flange)
        velocity = pin.getFrameVelocity(model, data, self._flange, pin.LOCAL_WORLD_ALIGNED)
        return placement.translation.tolist(), velocity.linear.tolist()

    def momentum(self, q: Floats, qd: Floats, payload: Payload) -> float:
        """Magnitude of the momentum of the links and the payload, |Σ m v| [kg m/s]."""
        self._load(payload)
        momentum = pin.computeCentroidalMomentum(self._model, self._data, q, qd)
        return hypot(*momentum.linear.tolist())

    def moment(self, motion: Floats, payload: Payload) -> list[float]:
        """Torques that a motion needs, one for each joint [N m]; the motion as for `tool`."""
        self._load(payload)
        torque: list[float] = pin.rnea(self._model, self._data, motion[0], motion[1], motion[2]).tolist()
        return torque

    def base_wrench(self, motion: Floats, payload: Payload) -> list[float]:
        """Force [N] and torque [N m] of the arm on its base, base frame; without the base's own weight.

        The motion is as for `tool`.
        """
        self._load(payload)
        pin.rnea(self._model, self._data, motion[0], motion[1], motion[2])
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

"""Mechanics of the rigid arm with the declared payload, for the instruments."""

from collections.abc import Sequence
from math import hypot

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.instruments.wrench import ROWS, SHAPED_QD, estimate
from tvist_controller.kinematics.arm import AT_FLANGE, Arm, end_motion
from tvist_controller.setup import body
from tvist_plant.chain import BODY, momentum, sweep
from tvist_plant.description import RobotDescription
from tvist_plant.model import Floats
from tvist_protocol.values import Payload

ELBOW = 2  # index of the joint whose axis is the elbow


def add(a: list[float], b: list[float]) -> list[float]:
    """Return the sum of two vectors as lists; numpy takes ten times as long for three numbers."""
    return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]


def cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """Return the cross product a × b as a list."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def carried(omega: list[float], alpha: list[float], arm: list[float]) -> list[float]:
    """Return the acceleration of a point relative to another, α × r + ω × (ω × r) [m/s²]; `arm` is r."""
    return add(cross(alpha, arm), cross(omega, cross(omega, arm)))


@compiled_for_ticks
def momentum_of(chain: Floats, q: Floats, qd: Floats, bodies: Floats) -> tuple[float, float, float]:
    """Return the linear momentum of all links, Σ m v [kg m/s]; arguments as `tvist_plant.chain.sweep`."""
    sweep(chain, q, qd, np.zeros(q.shape[0]), 0.0, bodies)
    x = y = z = 0.0
    for j in range(q.shape[0]):
        _, _, _, u, v, w = momentum(bodies[j, 6:16], bodies[j, 16:22])
        x, y, z = x + u, y + v, z + w
    return x, y, z


class RigidBody:
    """The rigid arm with the declared payload, as the controller models them.

    Motions are joint positions [rad], velocities [rad/s] and accelerations [rad/s²], shape (3, n). Offsets
    are the tool centre point in the flange frame: x y z [m] and rotation vector [rad].
    """

    def __init__(self, description: RobotDescription) -> None:
        self.arm = self._tool = Arm(description)
        self._payload: Payload | None = None
        self._offset: tuple[float, ...] = AT_FLANGE
        drives = description.drives
        self._drives = np.array([drives.rotor_inertia, drives.coulomb_friction])
        self._width, self._linear = drives.friction_width, drives.linear_friction
        self._joints_to_elbow = min(description.joints, ELBOW)
        still = np.zeros((3, description.joints))
        self.tool(still, AT_FLANGE)  # this loads compiled code, which takes many ticks, as the next three do
        self.external(np.zeros((ROWS, description.joints)), AT_FLANGE)
        self.arm.pose(still[0])
        momentum_of(self.arm.chain, still[0], still[1], self.arm.scratch)

    def tool(self, motion: Floats, offset: Sequence[float]) -> Floats:
        """Return pose [m, rad], velocity [m/s, rad/s] and acceleration of the TCP, base frame, (18,)."""
        tool = self._at(offset)
        return np.concatenate((tool.motion(motion[0], motion[1]), tool.acceleration(*motion)))

    def _at(self, offset: Sequence[float]) -> Arm:
        if (wanted := tuple(offset)) != self._offset:
            self._offset, self._tool = wanted, self.arm.with_tool(wanted)
        return self._tool

    def external(self, rows: Floats, offset: Sequence[float]) -> Floats:
        """Return external force and torque at the TCP, base frame, then joint torques [N, N m], (6 + n,).

        External joint torques are those of drives that follow their target (rigid arm with the declared payload, rotors
        and friction) minus the measured ones; the rows are those of `joint_lists`.

        F with Jᵀ F = τ follows by damped least squares, F = J (Jᵀ J + λ² 1)⁻¹ τ, with λ = λ₀ (1 - w/w₀) if the
        manipulability w is below w₀ (Nakamura and Hanafusa, 1986). Components that affect no joint are zero.
        """
        share = rows[SHAPED_QD] / self._width
        out = np.empty(6 + len(share))
        estimate(self._at(offset).chain, rows, self._drives, share if self._linear else np.tanh(share), out)
        return out

    def elbow(self, q: Floats, qd: Floats) -> tuple[list[float], list[float]]:
        """Return position [m] and velocity [m/s] of the elbow's axis, or of the flange without an elbow."""
        joints, out = self._joints_to_elbow, np.empty(12)
        end_motion(self.arm.chain[: joints + 1], q[:joints], qd[:joints], out)
        return out[:3].tolist(), out[6:9].tolist()

    def momentum(self, q: Floats, qd: Floats, payload: Payload) -> float:
        """Return the magnitude of the momentum of links and payload, |Σ m v| [kg m/s]."""
        self._load(payload)
        return hypot(*momentum_of(self.arm.chain, q, qd, self.arm.scratch))

    def moment(self, motion: Floats, payload: Payload) -> list[float]:
        """Return the joint torques of a motion [N m]."""
        self._load(payload)
        return list(self.arm.torque(*motion).tolist())

    def base_wrench(self, motion: Floats, payload: Payload) -> list[float]:
        """Return force [N] and torque [N m] on the base, base frame, without the base's own weight."""
        self.moment(motion, payload)
        torque, force = -self.arm.scratch[0, 22:25], -self.arm.scratch[0, 25:28]
        return [*force.tolist(), *torque.tolist()]

    def _load(self, payload: Payload) -> None:
        if payload is self._payload or payload == self._payload:
            return
        self._payload = payload
        self.arm.chain[-2, BODY:] = self.arm.loaded(body(payload))

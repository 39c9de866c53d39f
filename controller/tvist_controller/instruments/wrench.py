"""The wrench at the tool: the external force and torque, estimated from the drives' torques."""

from collections.abc import Sequence
from math import sqrt

import numpy as np
import pinocchio as pin

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, Floats, rigid_model
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import State

NEAR_SINGULAR = 0.01
"""Manipulability √det(J Jᵀ) below which forces are damped; a UR5e reaches 0.11 [m³ with six joints]."""
DAMPING = 0.08
"""λ₀, the damping factor at a singular posture [m, or -]."""
RUNNING = int(RobotMode.RUNNING)
"""Robot mode in which the drives hold the arm, as a plain integer, since it is compared often."""


def since_zeroed(wrench: list[float], zero: list[float] | None) -> list[float]:
    """Return a wrench relative to the one that a program has taken as zero, if there is one [N, N m]."""
    return wrench if zero is None else [felt - none for felt, none in zip(wrench, zero, strict=True)]


class ToolWrench:
    """Estimates the force at the tool centre point that explains the measured torques.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._model = rigid_model(description, Payload())
        self._data = self._model.createData()
        self._flange = self._model.getFrameId(FLANGE)
        drives = description.drives
        self._rotor = np.array(drives.rotor_inertia)
        self._friction = np.array(drives.coulomb_friction)
        self._width, self._linear = drives.friction_width, drives.linear_friction

    def felt(self, state: State) -> Floats:
        """Return the external torque on the joints, shape (n,) [N m].

        It is the torque of drives that follow their target (rigid arm with the declared payload, rotors and
        friction), minus the measured torque.
        """
        if state.robot_mode != RUNNING:
            return np.zeros(len(state.actual_q))
        velocity = np.array(state.target_qd) / self._width
        friction = self._friction * (velocity if self._linear else np.tanh(velocity))
        expected = np.array(state.target_moment) + self._rotor * np.array(state.target_qdd) + friction
        return np.array(expected - np.array(state.actual_moment))

    def at_tool(self, q: Sequence[float], torque: Floats, offset: Sequence[float]) -> Floats:
        """Return the force at the tool centre point that causes these joint torques, shape (6,) [N, N m], base frame.

        F with Jᵀ F = τ by damped least squares, F = J (Jᵀ J + λ² 1)⁻¹ τ, with λ = λ₀ (1 - w/w₀) if the manipulability
        w is below w₀ (Nakamura and Hanafusa, 1986). Components that affect no joint are zero.

        Args:
            q: Joint positions [rad].
            torque: External torque on the joints, shape (n,) [N m].
            offset: Tool centre point in the flange frame [m, rad].
        """
        jacobian = pin.computeFrameJacobian(
            self._model, self._data, np.array(q), self._flange, pin.LOCAL_WORLD_ALIGNED
        ).reshape(6, -1)  # for an arm with one joint, pinocchio returns a one-dimensional array
        rotation = self._data.oMf[self._flange].rotation
        if any(offset[:3]):
            jacobian[:3] -= pin.skew(rotation @ np.array(offset[:3])) @ jacobian[3:]
        tall = jacobian.shape[1] <= jacobian.shape[0]
        square = jacobian.T @ jacobian if tall else jacobian @ jacobian.T
        manipulability = sqrt(max(float(np.linalg.det(square)), 0.0))
        if manipulability < NEAR_SINGULAR:
            damping = DAMPING * (1.0 - manipulability / NEAR_SINGULAR)
            square.flat[:: len(square) + 1] += damping * damping
        if tall:
            return np.array(jacobian @ np.linalg.solve(square, torque))
        return np.array(np.linalg.solve(square, jacobian @ torque))

    def of(self, state: State, offset: Sequence[float]) -> list[float]:
        """Return force and torque at the tool centre point in a tick, base frame [N, N m]; zero with the brakes on.

        Args:
            state: State of the tick.
            offset: Tool centre point in the flange frame: x y z [m] and rotation vector [rad].
        """
        if state.robot_mode != RUNNING:
            return [0.0] * 6
        wrench: list[float] = self.at_tool(state.actual_q, self.felt(state), offset).tolist()
        return wrench

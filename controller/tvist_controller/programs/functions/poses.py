"""Functions for the arm's kinematics and dynamics."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.commands.refusal import RefusalError, check_joints
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.programs import arguments
from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import a_list, a_pose, is_pose, numbers
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_protocol.io import Length
from tvist_urscript import Array, Fault, Pose, costs


class PoseFunctions:
    """Answers questions about one robot's kinematics.

    Args:
        access: The robot.
        kinematics: Its kinematics.
    """

    def __init__(self, access: Access, kinematics: ProgramKinematics) -> None:
        self._access, self._kinematics = access, kinematics
        self._joints = access.description.joints
        self._dynamics = InverseDynamics(access.description, access.motion.cycle.dynamics.payload)

    @costs(150)
    def get_inverse_kin(
        self,
        x: object,
        qnear: object = None,
        maxPositionError: object = 1e-10,
        maxOrientationError: object = 1e-10,
        tcp: object = None,
    ) -> Array:
        """Return the joint positions nearest to others, or to the present ones, at which the tool has a pose.

        The solution is exact to rounding, so both errors are met whatever they are.
        """
        del maxPositionError, maxOrientationError
        return a_list(self._kinematics.posture(arguments.pose("x", x), self._near(qnear), _tool(tcp)))

    @costs(150)
    def get_inverse_kin_has_solution(
        self,
        x: object,
        qnear: object = None,
        maxPositionError: object = 1e-10,
        maxOrientationError: object = 1e-10,
        tcp: object = None,
    ) -> bool:
        """Return whether `get_inverse_kin` has an answer."""
        del maxPositionError, maxOrientationError
        return self._solution(arguments.pose("x", x), self._near(qnear), _tool(tcp)) is not None

    @costs(80)
    def get_forward_kin(self, q: object = None, tcp: object = None) -> Pose:
        """Return the pose of the tool at joint positions, or at the measured ones."""
        return a_pose(self._kinematics.tool_pose(self._posture(q), _tool(tcp)))

    @costs(200)
    def is_within_safety_limits(self, pose: object, qNear: object = None) -> bool:
        """Return whether the arm can be at a pose or at joint positions: within their range, without a collision."""
        if is_pose(pose):
            q = self._solution(arguments.pose("pose", pose), self._near(qNear))
        else:
            q = numbers("pose", pose, self._joints)
        if q is None:
            return False
        try:
            check_joints(q, self._access.description)
        except RefusalError:
            return False
        return self._access.motion.collisions.meeting(np.array(q)) is None

    @costs(110)
    def get_jacobian(self, q: object = None, tcp: object = None) -> Array:
        """Return the Jacobian of the tool in the base frame, rows for velocity and angular velocity."""
        matrix = self._kinematics.jacobian(self._posture(q), _tool(tcp))
        return Array(tuple(a_list(row) for row in matrix.tolist()))

    @costs(280)
    def get_mass_matrix(self, q: object = None, include_rotors_inertia: object = True) -> Array:
        """Return the inertia matrix of the joints with the declared payload [kg m^2]."""
        self._dynamics.believe(self._access.motion.cycle.dynamics.bodies)
        matrix = self._dynamics.inertia(self._posture(q))
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        if include_rotors_inertia:
            matrix = matrix + np.diag(self._access.description.drives.rotor_inertia)
        return Array(tuple(a_list(row) for row in matrix.tolist()))

    def _solution(
        self, goal: Sequence[float], near: Sequence[float], tcp: Sequence[float] | None = None
    ) -> tuple[float, ...] | None:
        """Joint positions nearest to others at which the tool has a pose; None if there are none."""
        try:
            return self._kinematics.posture(goal, near, tcp)
        except Fault:
            return None

    def _near(self, near: object) -> Sequence[float]:
        if near is None:
            return self._access.latest().actual_q
        return numbers("qnear", near, self._joints)

    def _posture(self, q: object) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        wanted = self._access.latest().actual_q if q is None else numbers("q", q, self._joints)
        return np.array(wanted, dtype=float)


def _tool(tcp: object) -> Sequence[float] | None:
    return None if tcp is None else arguments.pose("tcp", tcp, Length)

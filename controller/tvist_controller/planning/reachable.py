"""Questions about poses: which joint positions reach one, and why the joints cannot follow a path to one."""

from collections.abc import Sequence

import numpy as np

from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.paths.poses import Placement, placement
from tvist_controller.paths.tracking import Tracker, WayError
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.refusal import RefusalError, check_joints
from tvist_plant.description import RobotDescription
from tvist_protocol import kinematics as k
from tvist_protocol.replies import Posture, ToolPose


class Reachable:
    """Answers these questions for one robot."""

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._inverse = InverseKinematics(description)

    def posture(self, question: k.InverseKinematics, now: Snapshot) -> Posture:
        """Return the joint positions at which the tool has a pose, nearest to others.

        Raises:
            RefusalError: There are none, or they are outside the joints' range.
        """
        near = now.q
        if question.near is not None:
            check_joints(question.near, self._description, "near")
            near = np.array(question.near, dtype=float)
        goal = placement(question.frame) @ placement(question.pose)
        tcp = now.tcp if question.tcp_offset is None else question.tcp_offset
        flange = goal @ placement(tcp).inverse
        try:
            q = self._inverse.solve(flange.rotation, flange.position, near)
        except InverseKinematicsError as error:
            raise RefusalError(error.code, "pose", f"pose {_shown(goal)}: {error}", error.limit) from error
        return Posture(q=tuple(q.tolist()))

    def pose(self, question: k.ForwardKinematics, now: Snapshot) -> ToolPose:
        """Return the pose that the tool has at joint positions.

        Raises:
            RefusalError: They have the wrong number, or are outside the joints' range.
        """
        q = now.q
        if question.q is not None:
            check_joints(question.q, self._description)
            q = np.array(question.q, dtype=float)
        tcp = now.tcp if question.tcp_offset is None else question.tcp_offset
        found = placement(question.frame).inverse @ Tracker(self._description, tcp).pose(q)
        return ToolPose(pose=found.vector)

    def refusal(
        self, error: WayError, field: str, share: float, goal: Placement, tcp: Sequence[float]
    ) -> RefusalError:
        """Return the refusal of a command whose path, by this field, ends at a share of the way, 0 to 1 [-]."""
        at = f"{field}: after {100.0 * share:.0f} % of the way, at {_shown(error.pose)}"
        for pose, where in ((goal, f"{field} {_shown(goal)}"), (error.pose, at)):
            flange = pose @ placement(tcp).inverse
            try:
                self._inverse.solve(flange.rotation, flange.position, error.q)
            except InverseKinematicsError as unreachable:
                return RefusalError(unreachable.code, field, f"{where}: {unreachable}", unreachable.limit)
        if share == 0.0:
            why = f"{field}: the arm is in a singular posture, from which it cannot move the tool so: use move_j first"
            return RefusalError("singular", field, why)
        near = ", ".join(f"{angle:.2f}" for angle in error.q)
        why = f"{at}, the arm passes a singular posture (near [{near}] rad): go round it, or move there with move_j"
        return RefusalError("singular", field, why)


def _shown(pose: Placement) -> str:
    return "[" + ", ".join(f"{value:.3f}" for value in pose.vector) + "]"

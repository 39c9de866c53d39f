"""Questions about the arm's kinematics, which move nothing and need no lease."""

from tvist_protocol.client_message import ClientMessage
from tvist_protocol.values import Joints, Pose


class InverseKinematics(ClientMessage, frozen=True, kw_only=True, tag="inverse_kinematics"):
    """Ask for joint positions at which the tool has a pose; answered by `posture`."""

    pose: Pose
    """Pose of the tool centre point: x y z [m] and rotation vector [rad]."""
    near: Joints | None = None
    """Posture to which the answer should be nearest, one angle per joint [rad]; null: the present reference."""
    tcp_offset: Pose | None = None
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]; null: that of `set_tcp`."""
    frame: Pose | None = None
    """Frame in which `pose` is given, as a pose in the base frame; null: the base frame."""


class ForwardKinematics(ClientMessage, frozen=True, kw_only=True, tag="forward_kinematics"):
    """Ask for the pose that the tool has at joint positions; answered by `tool_pose`."""

    q: Joints | None = None
    """Posture, one angle per joint [rad]; null: the present reference."""
    tcp_offset: Pose | None = None
    """Tool centre point in the flange frame: x y z [m] and rotation vector [rad]; null: that of `set_tcp`."""
    frame: Pose | None = None
    """Frame in which the answer is given, as a pose in the base frame; null: the base frame."""

"""Questions to a robot about its kinematics, for which no control is needed."""

from abc import ABC, abstractmethod
from collections.abc import Iterable

from tvist_client.commanded import Answer
from tvist_client.errors import UnexpectedReplyError
from tvist_client.values import floats, optional_pose, pose_of
from tvist_protocol.commands import Command
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.replies import Posture, ToolPose


class Kinematics(ABC):
    """The part of `Robot` that answers questions about poses and postures.

    Poses are any sequence of six numbers: x y z [m] and rotation vector [rad].
    """

    @abstractmethod
    async def request(self, command: Command, timeout_s: float = ...) -> Answer:
        """Send any command."""

    async def inverse_kinematics(
        self,
        pose: Iterable[float],
        *,
        near: Iterable[float] | None = None,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, ...]:
        """Return joint positions at which the tool has a pose, the nearest of all.

        Args:
            pose: Pose of the tool centre point.
            near: Posture to which the answer should be nearest [rad]; None for the present reference.
            tcp_offset: Tool centre point in the flange frame; None for that of `Arm.set_tcp`.
            frame: Frame in which `pose` is given, as a pose in the base frame; None for the base frame.

        Returns:
            One angle per joint [rad].

        Raises:
            RefusedError: No joint positions reach the pose: the code is `no_solution`.
        """
        reply = await self.request(
            InverseKinematics(
                pose=pose_of(pose, "pose"),
                near=None if near is None else floats(near, "near"),
                tcp_offset=optional_pose(tcp_offset, "tcp_offset"),
                frame=optional_pose(frame, "frame"),
            )
        )
        if not isinstance(reply, Posture):
            raise UnexpectedReplyError(f"inverse_kinematics was answered by {reply}, without a posture")
        return reply.q

    async def forward_kinematics(
        self,
        q: Iterable[float] | None = None,
        *,
        tcp_offset: Iterable[float] | None = None,
        frame: Iterable[float] | None = None,
    ) -> tuple[float, float, float, float, float, float]:
        """Return the pose that the tool has at joint positions.

        Args:
            q: Posture [rad]; None for the present reference.
            tcp_offset: Tool centre point in the flange frame; None for that of `Arm.set_tcp`.
            frame: Frame in which the answer is given, as a pose in the base frame; None for the base frame.

        Returns:
            Pose of the tool centre point.
        """
        reply = await self.request(
            ForwardKinematics(
                q=None if q is None else floats(q, "q"),
                tcp_offset=optional_pose(tcp_offset, "tcp_offset"),
                frame=optional_pose(frame, "frame"),
            )
        )
        if not isinstance(reply, ToolPose):
            raise UnexpectedReplyError(f"forward_kinematics was answered by {reply}, without a pose")
        return reply.pose

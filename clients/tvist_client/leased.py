"""Common part of all commands of a client with control."""

from typing import TYPE_CHECKING

from tvist_client.errors import UnexpectedReplyError
from tvist_client.motion import Motion
from tvist_protocol.channels import tag
from tvist_protocol.commands import Command
from tvist_protocol.replies import Accepted

if TYPE_CHECKING:
    from tvist_client.commanded import CommandedRobot


class Leased:
    """A lease on a robot.

    Args:
        robot: The robot it belongs to.
        token: Token of the lease.
    """

    token: str
    """Token of the lease, sent with every command."""

    def __init__(self, robot: "CommandedRobot", token: str) -> None:
        self.robot = robot
        self.token = token

    async def _begin(self, command: Command) -> Motion:
        """Send a command that begins a motion, and return the motion.

        Raises:
            UnexpectedReplyError: The answer has no number of a motion.
        """
        reply = await self.robot.request(command)
        if not isinstance(reply, Accepted) or reply.id is None:
            raise UnexpectedReplyError(
                f"{tag(type(command))} was answered by {reply}, without the id of a motion"
            )
        motion = self.robot.motions.motion(reply.id)
        motion.limited = reply.limited
        return motion

"""Common part of all commands of a client with control."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_client.commanded import CommandedRobot


class Leased:
    """A lease on a robot.

    Attributes:
        robot: The robot it belongs to.
        token: Token of the lease, sent with every command.
    """

    def __init__(self, robot: "CommandedRobot", token: str) -> None:
        self.robot = robot
        self.token = token

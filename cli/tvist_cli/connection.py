"""Options about where a served robot is, the same on every command that reaches one."""

from dataclasses import dataclass, field
from pathlib import Path

from cyclopts import Parameter

from tvist_client.readiness import unlock_command
from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.zenoh import only_robot


@Parameter(name="*")
@dataclass(frozen=True)
class Connection:
    """Where a robot is. A command whose first parameter this is also takes the endpoint without its option."""

    endpoint: str = ENDPOINT
    """Zenoh endpoint of the robot, or of a router."""
    name: str | None = field(default=None, kw_only=True)
    """Name of the robot [ur5e; if there is none, the only robot at the endpoint]."""
    namespace: str = field(default="", kw_only=True)
    """Namespace of the robot, if it is served in one."""
    security: Path | None = field(default=None, kw_only=True)
    """Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT."""

    async def robot(self) -> Robot:
        """Connect to the robot.

        Raises:
            ClientError: It does not answer, or there are several and none was named.
        """
        name = self.name or await only_robot(self.endpoint, NAME, self.security, self.namespace)
        return await Robot.connect(self.endpoint, name, security=self.security, namespace=self.namespace)

    def unlock_command(self, name: str) -> str:
        """Return the command line that unlocks the robot of this name."""
        return unlock_command(self.endpoint, name, self.security, self.namespace)


LOCAL = Connection()
"""The only robot on this machine."""

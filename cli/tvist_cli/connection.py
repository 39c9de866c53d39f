"""Options that locate a served robot, the same on every command that connects to one."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from cyclopts import Parameter

from tvist_client.readiness import unlock_command
from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.zenoh import only_robot

T = TypeVar("T")


@Parameter(name="*")
@dataclass(frozen=True)
class Connection:
    """Where a robot is. A command that has this as its first parameter also takes the endpoint without its option."""

    endpoint: str = ENDPOINT  # connect to the robot or router at this Zenoh endpoint
    name: str | None = field(default=None, kw_only=True)
    """Select the robot of this name [ur5e; if there is none, the only robot at the endpoint]."""
    namespace: str = field(default="", kw_only=True)  # look for the robot in this namespace
    security: Path | None = field(default=None, kw_only=True)
    """Use this client's certificate from this folder, made by tvist keys; the endpoint is then tls/HOST:PORT."""

    async def robot(self) -> Robot:
        """Connect to the robot; raise ClientError if it does not answer, or if there are several and none was named."""
        name = self.name or await only_robot(self.endpoint, NAME, self.security, self.namespace)
        return await Robot.connect(self.endpoint, name, security=self.security, namespace=self.namespace)

    def run(self, use: Callable[[Robot], Awaitable[T]]) -> T:
        """Connect to the robot and return the result of `use`."""

        async def used() -> T:
            async with await self.robot() as robot:
                return await use(robot)

        return asyncio.run(used())

    def unlock_command(self, name: str) -> str:
        """Return the command line that unlocks the robot of this name."""
        return unlock_command(self.endpoint, name, self.security, self.namespace)


LOCAL = Connection()

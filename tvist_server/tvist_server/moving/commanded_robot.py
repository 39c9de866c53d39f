"""The robot as it is read and written."""

from collections.abc import Sequence

from tvist_server.moving.connection import CommandingConnection
from tvist_server.moving.registers import INPUTS, OUTPUTS
from tvist_server.rtde.commanding import CommandingClient
from tvist_server.watching.connection import Connection
from tvist_server.watching.variables import NEEDED, OPTIONAL
from tvist_server.watching.watched_robot import WatchedRobot


class CommandedRobot(WatchedRobot):
    """Reads one robot, and writes the inputs that are claimed; see `WatchedRobot`."""

    done = "moved"

    def write(self, numbers: Sequence[float]) -> None:
        """Write all inputs, in the order of `INPUTS`; nothing happens while there is no connection."""
        if isinstance(self._connection, CommandingConnection):
            self._connection.write(numbers)

    def _new_connection(self) -> Connection:
        client = CommandingClient({**NEEDED, **OUTPUTS}, OPTIONAL, INPUTS)
        return CommandingConnection(self._place, self._address, client)

    @property
    def connected(self) -> bool:
        """Whether it is connected."""
        return self._connection is not None

"""A connection to a robot's RTDE interface that also writes."""

from collections.abc import Sequence

from tvist_server.rtde.commanding import CommandingClient
from tvist_server.watching.connection import Address, Connection
from tvist_server.watching.place import Place


class CommandingConnection(Connection):
    """One connection.

    Args:
        place: See `Connection`, as for the address.
        address: Its resolved address.
        client: What is read and written there.
    """

    def __init__(self, place: Place, address: Address, client: CommandingClient) -> None:
        super().__init__(place, address, client)
        self._commanding = client
        self._rest = b""
        self.unsent = 0
        """Number of packages that were left out, since those before them still waited to be sent."""

    def write(self, numbers: Sequence[float]) -> None:
        """Write all inputs, without waiting: while a link takes nothing, packages are left out, and not kept."""
        if not self.client.started:
            return
        if self._rest:
            self._rest = self._rest[self._give(self._rest) :]
        if self._rest:
            self.unsent += 1
            return
        data = self._commanding.write(numbers)
        self._rest = data[self._give(data) :]

    def _give(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except OSError:  # a lost connection shows when it is read
            return 0

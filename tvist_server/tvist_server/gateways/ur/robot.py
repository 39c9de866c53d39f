"""State that all interfaces of one robot share, and the owners of its input variables."""

from collections.abc import Callable, Hashable, Sequence
from zlib import crc32

from tvist_controller.instruments.snapshot import Snapshot
from tvist_plant.description import RobotDescription
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.programs import Programs

NO_MODE = "NONE"  # operational mode until a client sets one


class UrRobot:
    """State of one robot that the clients of its interfaces share."""

    def __init__(
        self,
        description: RobotDescription,
        name: str,
        tell: Callable[[bytes], None],  # sends a robot message to all clients that get them
        external: ExternalControl,  # completes programs with an External Control node
        report: Callable[[str], None],  # writes a line to the server's console
        report_refusal: Callable[[str], None],  # writes a refusal to the console, with its own limit of lines
    ) -> None:
        self.description, self.name = description, name
        self.tell, self.report, self.report_refusal = tell, report, report_refusal
        self.serial = f"2024550{crc32(name.encode()) % 10_000:04d}"
        """Serial number: the year, as UR's have, and digits derived from the name."""
        self.latest: Snapshot | None = None  # snapshot of the last tick; None before the first
        self.operational_mode = NO_MODE  # operational mode set on the dashboard
        self.inputs = InputOwners()
        self.programs = Programs(self, external)


class InputOwners:
    """Owners of input variables: the first connection to request one owns it until the connection closes."""

    def __init__(self) -> None:
        self._owners: dict[str, object] = {}
        self.pending = PendingWrites()  # values written by any connection

    def is_free(self, name: str, connection: object) -> bool:
        return self._owners.get(name, connection) is connection

    def take(self, names: Sequence[str], connection: object) -> None:
        """Make a connection the owner of variables, which must be free."""
        for name in names:
            self._owners[name] = connection

    def release(self, connection: object) -> None:
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not connection}


class PendingWrites:
    """Values sent to the controller: clients repeat values at 500 Hz, but each is to be sent only once.

    A value is new if it differs from the last one sent, or if that one is answered and the robot now
    publishes another value, which another client has set.
    """

    def __init__(self) -> None:
        self._asked: dict[Hashable, object] = {}
        self._waiting: dict[Hashable, object] = {}

    def changed(self, key: Hashable, value: object, present: object) -> bool:
        """Return whether a value must be sent; `present` is what the robot last published, None: none yet."""
        if key in self._waiting:
            return self._waiting[key] != value
        return value != present or self._asked.get(key, value) != value

    def ask(self, values: dict[Hashable, object]) -> None:
        self._asked |= values
        self._waiting |= values

    def answered(self, values: dict[Hashable, object]) -> None:
        for key, value in values.items():
            if self._waiting.get(key) == value:
                del self._waiting[key]

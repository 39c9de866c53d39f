"""Address of a real robot: ur://ADDRESS[:PORT]."""

from typing import NamedTuple
from urllib.parse import urlsplit

SCHEME = "ur://"
PORT = 30004


class RobotAddress(NamedTuple):
    """Address of a robot's RTDE interface."""

    host: str  # name or IP address
    port: int = PORT

    def beside(self, port: int) -> "RobotAddress":
        """Return another interface's address with UR's port number `port`, shifted as much as RTDE's port."""
        return self._replace(port=port + self.port - PORT)

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{SCHEME}{host}" + ("" if self.port == PORT else f":{self.port}")


def is_place(plant: str) -> bool:
    """Return whether the name of a plant looks like the address of a robot."""
    return plant.lower().startswith(SCHEME)


def place_of(plant: str) -> RobotAddress:
    """Return the address; raise ValueError if it is invalid."""
    try:
        parts = urlsplit(plant)
        port = PORT if parts.port is None else parts.port
    except ValueError:  # the port is not a number, or too large
        parts, port = urlsplit(SCHEME), 0
    if not parts.hostname or port == 0 or parts.username or parts.path.strip("/") or parts.query:
        raise ValueError(
            f"plant is {plant!r}: must be ur://ADDRESS or ur://ADDRESS:PORT, such as ur://192.168.0.10, with a port "
            f"from 1 to 65535 [{PORT}, that of RTDE]"
        )
    return RobotAddress(parts.hostname, port)

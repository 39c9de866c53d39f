"""A link between a client and a robot that can be cut, held up, delayed and made slow."""

from tests.places import free_port
from tests.system.relay import Relay


class Proxy(Relay):
    """The link in front of one endpoint.

    Args:
        target: The robot's endpoint, `tcp/<host>:<port>`.
        address: Where it listens: IP address and port; None for a free port of 127.0.0.1.
    """

    def __init__(self, target, address=None):
        host, port = target.partition("/")[2].split(":")
        super().__init__((host, int(port)), address or ("127.0.0.1", free_port()))

"""Listening sockets of UR's interfaces."""

import errno
import socket
import sys

from tvist_server.gateways.base import GatewayError
from tvist_server.ur_ports import InterfaceName

SEND_BUFFER = 32_768  # system's send buffer for a client [bytes]: 0.1 s of samples; more would only add delay
PROBES = (10, 5, 3)
"""TCP keepalive: idle time before the first probe [s], time between probes [s], and number of unanswered
probes after which a client counts as disconnected and loses control, as when its machine has lost power."""


def listen(address: str, port: int, interface: InterfaceName) -> socket.socket:
    """Return a socket that listens for clients of an interface; raise GatewayError if that is impossible."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Accepted sockets inherit these options.
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        _probe(bound)
        bound.bind((address, port))
        bound.listen(32)
    except OSError as error:
        bound.close()
        raise GatewayError(
            f"cannot listen on {address} port {port} for {interface}: {_reason(error)}"
        ) from error
    bound.setblocking(False)
    return bound


def _probe(bound: socket.socket) -> None:
    if sys.platform == "linux":
        options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        for option, value in zip(options, PROBES, strict=True):
            bound.setsockopt(socket.IPPROTO_TCP, option, value)


def _reason(error: OSError) -> str:
    reasons = {
        errno.EADDRINUSE: "the port is in use: stop the program that uses it, or choose another port with --ur-port",
        errno.EADDRNOTAVAIL: "this machine does not have this address; it has 127.0.0.1 to 127.255.255.254",
        errno.EACCES: "that is not permitted: choose a port above 1023",
    }
    return reasons.get(error.errno or 0, error.strerror or str(error))

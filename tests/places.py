"""Ports and addresses of this machine that no other process of tests has, so that tests can run side by side."""

import itertools
import os
import socket

FIRST_PORT, PORTS, PROCESSES = 10_000, 200, 99
"""Below the ports that systems give to outgoing connections, and below UR's own, which begin at 29999."""

_count = itertools.count()


def own_address(last):
    """An address of the loopback network, for servers whose ports cannot be chosen; `last` is its last byte."""
    pid = os.getpid()
    return f"127.{pid // 250 % 250 + 1}.{pid % 250 + 1}.{last}"


def free_port():
    """A port of 127.0.0.1 on which nobody listens.

    Raises:
        OSError: Somebody listens on all that this process may take.
    """
    first = FIRST_PORT + os.getpid() % PROCESSES * PORTS
    for _ in range(PORTS):
        port = first + next(_count) % PORTS
        if _is_free(port):
            return port
    raise OSError(f"ports {first} to {first + PORTS - 1} of 127.0.0.1 are all in use")


def free_endpoint():
    """An endpoint of Zenoh on which a robot can be served."""
    return f"tcp/127.0.0.1:{free_port()}"


def _is_free(port):
    with socket.socket() as probe:
        probe.setsockopt(
            socket.SOL_SOCKET, socket.SO_REUSEADDR, 1
        )  # as servers do: an old connection is no listener
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True

"""Ports and addresses of this machine that no parallel test process uses."""

import itertools
import os
import socket
from functools import cache

FIRST_PORT, PORTS, PROCESSES = 10_000, 200, 99
"""These ports are below those of outgoing connections, and below UR's, which start at 29999."""

_count, _held = itertools.count(), []


def own_address(last):
    """Return a loopback address for servers with fixed ports; `last` is its last byte."""
    pid = os.getpid()
    return f"127.{pid // 250 % 250 + 1}.{pid % 250 + 1}.{last}"


def free_port():
    """Return a free port of 127.0.0.1; OSError if this process has none left."""
    first = _first_port()
    for _ in range(PORTS - 1):
        port = first + 1 + next(_count) % (PORTS - 1)
        if _is_free(port):
            return port
    raise OSError(f"ports {first} to {first + PORTS - 1} of 127.0.0.1 are all in use")


@cache
def _first_port():
    """Reserve a range of ports for this process until its end; return the first one."""
    for number in range(PROCESSES):
        first = FIRST_PORT + (os.getpid() + number) % PROCESSES * PORTS
        held = socket.socket()
        try:
            held.bind(("127.0.0.1", first))
        except OSError:
            held.close()
            continue
        _held.append(held)
        return first
    raise OSError(f"{PROCESSES} processes of tests hold all ports from {FIRST_PORT} on")


def free_endpoint():
    """Return a Zenoh endpoint for a robot."""
    return f"tcp/127.0.0.1:{free_port()}"


def _is_free(port):
    with socket.socket() as probe:
        # As servers do: an old connection is no listener.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True

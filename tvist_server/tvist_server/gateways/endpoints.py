"""Zenoh endpoints, `<protocol>/<address>[?metadata][#options]`: which of them others can reach."""

import ipaddress
import socket

IP_PROTOCOLS = frozenset({"tcp", "udp", "ws", "tls", "quic"})
LOCAL_PROTOCOLS = frozenset({"unixsock-stream"})
"""These never leave the machine."""


def protocol(endpoint: str) -> str:
    """`tcp` of `tcp/127.0.0.1:7447`; empty where there is none."""
    before, slash, _ = endpoint.partition("/")
    return before if slash else ""


def options(endpoint: str) -> str:
    """What stands behind `#`, which goes before the session's own settings; empty where there is none."""
    return endpoint.partition("#")[2]


def is_local(endpoint: str) -> bool:
    """Whether only this machine can reach an endpoint.

    Whatever is not known to be local counts as not: a protocol this does not know, a name that cannot be
    looked up, a name of which one address among others leaves the machine.
    """
    if protocol(endpoint) in LOCAL_PROTOCOLS:
        return True
    if protocol(endpoint) not in IP_PROTOCOLS:
        return False
    address = endpoint.partition("/")[2].partition("#")[0].partition("?")[0]
    host = address.rpartition(":")[0].removeprefix("[").removesuffix("]")
    addresses = _addresses(host)
    return bool(addresses) and all(address.is_loopback for address in addresses)


def _addresses(host: str) -> list[ipaddress.IPv4Address | ipaddress.IPv6Address]:
    """All addresses of a host; none where there is no such host, or no host is named."""
    if not host:
        return []
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
        return [ipaddress.ip_address(str(where[0]).partition("%")[0]) for *_, where in found]
    except (OSError, ValueError):
        return []

"""Zenoh endpoints, `<protocol>/<address>[?metadata][#options]`, and whether other machines can reach them."""

import ipaddress
import socket

IP_PROTOCOLS = frozenset({"tcp", "udp", "ws", "tls", "quic"})
LOCAL_PROTOCOLS = frozenset({"unixsock-stream"})  # Protocols that never leave the machine


def protocol(endpoint: str) -> str:
    """Return the protocol, such as `tcp` of `tcp/127.0.0.1:7447`; empty if there is none."""
    before, slash, _ = endpoint.partition("/")
    return before if slash else ""


def is_endpoint(endpoint: str) -> bool:
    """Return whether a text has the form of an endpoint: a word, a slash and an address."""
    word, slash, address = endpoint.partition("/")
    return bool(slash and address) and word.replace("-", "").isalnum()


def options(endpoint: str) -> str:
    """Return the part after `#`, which overrides the session's settings; empty if there is none."""
    return endpoint.partition("#")[2]


def is_local(endpoint: str) -> bool:
    """Return whether only this machine can reach an endpoint; False if in doubt, as for an unknown protocol or host."""
    if protocol(endpoint) in LOCAL_PROTOCOLS:
        return True
    if protocol(endpoint) not in IP_PROTOCOLS:
        return False
    address = endpoint.partition("/")[2].partition("#")[0].partition("?")[0]
    host = address.rpartition(":")[0].removeprefix("[").removesuffix("]")
    addresses = _addresses(host)
    return bool(addresses) and all(address.is_loopback for address in addresses)


def _addresses(host: str) -> list[ipaddress.IPv4Address | ipaddress.IPv6Address]:
    if not host:
        return []
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
        return [ipaddress.ip_address(str(where[0]).partition("%")[0]) for *_, where in found]
    except (OSError, ValueError):
        return []

"""The machines that URScript programs may open sockets to."""

import ipaddress
import re
from collections.abc import Sequence

from tvist_server.option_values import StartError

_NAME = re.compile(r"(?!.*(^|\.)\d+$)[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
"""Host names. The last label must not be a number: that would be a mistyped IP address."""


class AllowedHosts:
    """IP addresses, networks and host names that programs may connect to; StartError if any is invalid."""

    def __init__(self, given: Sequence[str]) -> None:
        self._names, self._networks = set(given), list[ipaddress.IPv4Network | ipaddress.IPv6Network]()
        for text in given:
            try:
                self._networks.append(ipaddress.ip_network(text, strict=False))
            except ValueError as error:
                if not _NAME.fullmatch(text):
                    raise StartError(
                        f"ur_allow has {text!r}: must be an IP address, a network such as 192.168.1.0/24, or a name"
                    ) from error

    def allows(self, name: str, address: str, origin: str | None) -> bool:
        """Return whether a program from `origin` (None: unknown) may connect to `address`, found for `name`.

        Programs from other machines may connect to the loopback interface only if it is listed itself.
        """
        to, sender = ip_of(address), None if origin is None else ip_of(origin)
        if to.is_loopback or to.is_unspecified:  # a name or a wide network must not open it as a side effect
            named = name == "localhost" and name in self._names
            inside = any(network.is_loopback and to in network for network in self._networks)
            return named or inside or (sender is not None and sender.is_loopback)
        return to == sender or name in self._names or any(to in network for network in self._networks)


def ip_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """Parse an address without its zone, and unwrap an IPv4-mapped IPv6 address."""
    found = ipaddress.ip_address(text.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found

"""The machines that programs may connect to."""

import ipaddress
import re
from collections.abc import Sequence

from tvist_server.option_values import StartError

LOCALHOST = "localhost"
_NAME = re.compile(r"(?!.*(^|\.)\d+$)[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
"""Host names. The last part is no number, since the whole would be a mistyped address."""
IpAddress = ipaddress.IPv4Address | ipaddress.IPv6Address


class AllowedHosts:
    """IP addresses, networks and names that the server allows, besides the machine that sent a program.

    Raises:
        StartError: One is none of these.
    """

    def __init__(self, given: Sequence[str]) -> None:
        for text in given:
            if _network(text) is None and not _NAME.fullmatch(text):
                raise StartError(
                    f"ur_allow has {text!r}: must be an IP address, a network such as 192.168.1.0/24, or a name"
                )
        self._names = set(given)
        self._networks = [network for text in given if (network := _network(text)) is not None]

    def allows(self, name: str, address: str, origin: str | None) -> bool:
        """Return whether a program may connect to an address, which stands for a machine that it names.

        The program comes from `origin`; None if that is unknown. The loopback interface is open to programs
        that came from there, and if it is given itself.
        """
        to, sender = _ip(address), None if origin is None else _ip(origin)
        if _is_here(to):  # a name or a wide network does not open it by the way
            named = name == LOCALHOST and name in self._names
            inside = any(network.is_loopback and to in network for network in self._networks)
            return named or inside or (sender is not None and sender.is_loopback)
        return to == sender or name in self._names or any(to in network for network in self._networks)


def _ip(text: str) -> IpAddress:
    """An address without its zone; an IPv4 address in IPv6's form counts as such."""
    found = ipaddress.ip_address(text.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found


def _is_here(address: IpAddress) -> bool:
    return address.is_loopback or address.is_unspecified


def _network(text: str) -> ipaddress.IPv4Network | ipaddress.IPv6Network | None:
    try:
        return ipaddress.ip_network(text, strict=False)
    except ValueError:  # a name
        return None

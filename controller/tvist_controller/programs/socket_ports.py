"""Network for the sockets of programs, as the host sees it."""

from collections.abc import Sequence
from typing import Protocol

from tvist_controller.programs.socket_traffic import Open, SocketNews, SocketOrder


class SocketPorts(Protocol):
    """Carries the sockets of one robot's programs. What happens to them reaches the host by `Host.socket`."""

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketNews]:
        """Carry out orders without blocking; return news that are known at once, which count after this tick."""


class NoPorts(SocketPorts):
    """No network: sockets cannot be opened."""

    def carry_out(self, orders: Sequence[SocketOrder]) -> Sequence[SocketNews]:
        """Report that a socket could not be opened."""
        return [SocketNews(order.socket, "failed") for order in orders if isinstance(order, Open)]

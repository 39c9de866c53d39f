"""A router for a fleet: Zenoh's own, with the settings of this house for access and for rates."""

import re
import resource
from collections.abc import Sequence
from typing import Any, NamedTuple, Self

from tvist_client.across import Place, place_of
from tvist_client.transports.session import close_session
from tvist_protocol import keys
from tvist_server.gateways.exposure import check_endpoints, guarded_router
from tvist_server.gateways.network import REALTIME, open_router

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
SESSIONS = 4096
"""Largest number of robots, clients and routers that are connected at once."""
MOST = 10_000
"""Largest count of robots in one word: each has rules of its own."""
FASTEST = 500.0
"""Largest rate of states to pass on [1/s]: a robot publishes no more."""
REDUCED = ("state", "truth")
"""Leaves of the keys whose rates can be reduced: each message says all, so that one more recent replaces it."""
_RATE = re.compile(r"(\d+(?:\.\d+)?)(?:@([\w.:-]+))?")


class Rate(NamedTuple):
    """A limit on the states of each robot that the router passes on."""

    hz: float
    """States per second."""
    interface: str | None
    """Network interface that they leave through; None: any."""

    @classmethod
    def read(cls, text: str) -> Self:
        """Read `10` or `10@eth1`.

        Raises:
            ValueError: It is neither, or no possible rate.
        """
        found = _RATE.fullmatch(text)
        if found is None or not 0.0 < float(found[1]) <= FASTEST:
            raise ValueError(
                f"rate is {text!r}: must be HZ or HZ@INTERFACE, such as 10 or 10@eth1, above 0 and up to {FASTEST:g}"
            )
        return cls(float(found[1]), found[2])


class Router:
    """A running router, which connects to other routers now or when they appear.

    It limits the states that leave: those of each of `robots`, and those of all others together. An interface
    that is named has its own rates.

    Raises:
        StartError: An endpoint is none, other machines could reach an unprotected one, or the folder is incomplete.
        GatewayError: The router cannot listen on an endpoint.
    """

    def __init__(
        self,
        listen: Sequence[str],
        connect: Sequence[str],
        rates: Sequence[Rate],
        robots: Sequence[Place],
        *,
        security: str | None,
        insecure: bool,
    ) -> None:
        check_endpoints("connect", connect)
        endpoints, guard = guarded_router(listen, security=security, insecure=insecure)
        _allow_files()
        settings = {
            **REALTIME,
            "transport/unicast/max_sessions": SESSIONS,
            **guard,
            **({"downsampling": downsampling(rates, robots)} if rates else {}),
        }
        self._session = open_router(endpoints, connect, settings, security)

    def close(self) -> None:
        """Close the router, which disconnects all robots and clients."""
        close_session(self._session)


def robots_of(text: str) -> list[Place]:
    """Read `[NAMESPACE/]NAME`, or `[NAMESPACE/]NAME*COUNT` for NAME-1 to NAME-COUNT, as `tvist serve` names them.

    Raises:
        ProtocolError: A namespace or a name is none.
        ValueError: The count is not from 1 to `MOST`.
    """
    first, star, count = text.partition("*")
    if not star:
        return [place_of(first)]
    number = int(count) if count.isascii() and count.isdigit() and len(count) < 9 else 0
    if not 1 <= number <= MOST:
        raise ValueError(f"robot is {text!r}: the count after * must be a whole number from 1 to {MOST}")
    return [place_of(f"{first}-{each}") for each in range(1, number + 1)]


def downsampling(rates: Sequence[Rate], robots: Sequence[Place]) -> list[dict[str, Any]]:
    """Return Zenoh's `downsampling` settings for what leaves the router.

    Zenoh counts by rule, not by key: a rule with a wildcard lets one robot's states use up what is meant for all. So
    each robot has rules of its own, and only robots that are not listed share one. The first rule that fits is taken.
    """
    places = [
        *(keys.within(place.namespace, f"{keys.PREFIX}/{place.robot}") for place in robots),
        keys.ANYWHERE,
    ]
    return [
        {
            "id": f"rate {number}",
            **({"interfaces": [rate.interface]} if rate.interface else {}),
            "messages": ["put"],
            "flows": ["egress"],
            "rules": [
                {"key_expr": f"{place}/{leaf}", "freq": rate.hz} for place in places for leaf in REDUCED
            ],
        }
        for number, rate in enumerate(rates)
    ]


def _allow_files() -> None:
    """Allow this process as many connections as the system permits; the usual limit is 1024 files."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))

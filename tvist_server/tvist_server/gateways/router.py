"""A router for a fleet: Zenoh's router with tvist's settings for access and rates."""

import re
import resource
from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import zenoh

from tvist_client.fleet import RobotPlace, place_of
from tvist_protocol import keys
from tvist_server.gateways.network import REALTIME, open_router
from tvist_server.gateways.security import check_endpoints, router_security
from tvist_server.option_values import count_of

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
SESSIONS = 4096  # largest total number of connected robots, clients and routers
MAX_COUNT = 10_000  # largest COUNT in `NAME*COUNT`; limited because each robot needs its own rules
FASTEST = 500.0  # largest rate of states to pass on [1/s], which is the rate at which a robot publishes
REDUCED = ("state", "truth")  # keys whose rates can be reduced, because each message replaces the one before
_RATE = re.compile(r"(\d+(?:\.\d+)?)(?:@([\w.:-]+))?")


class Rate(NamedTuple):
    """A limit on the rate of each robot's states that the router passes on."""

    hz: float  # states per second
    interface: str | None  # network interface that the states leave through; None: any

    @classmethod
    def read(cls, text: str) -> Self:
        """Parse `10` or `10@eth1`; ValueError if it has another form or an impossible rate."""
        found = _RATE.fullmatch(text)
        if found is None or not 0.0 < float(found[1]) <= FASTEST:
            raise ValueError(
                f"rate is {text!r}: must be HZ or HZ@INTERFACE, such as 10 or 10@eth1, above 0 and up to {FASTEST:g}"
            )
        return cls(float(found[1]), found[2])


def start_router(
    listen: Sequence[str],
    connect: Sequence[str],
    rates: Sequence[Rate],
    robots: Sequence[RobotPlace],
    *,
    security: str | None,
    insecure: bool,
) -> zenoh.Session:
    """Start a router; `rates` limit the outgoing states of each robot in `robots`, or of all if it is empty.

    May raise StartError or GatewayError.
    """
    check_endpoints("connect", connect)
    endpoints, guard = router_security(listen, security=security, insecure=insecure)
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)  # the limit in force is usually 1024
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    limits = {"downsampling": downsampling(rates, robots)} if rates else {}
    settings = {**REALTIME, "transport/unicast/max_sessions": SESSIONS, **guard, **limits}
    return open_router(endpoints, connect, settings, security)


def robots_of(text: str) -> list[RobotPlace]:
    """Parse `[NAMESPACE/]NAME`, or `[NAMESPACE/]NAME*COUNT` for NAME-1 to NAME-COUNT; may raise ValueError."""
    first, star, count = text.partition("*")
    if not star:
        return [place_of(first)]
    number = count_of(f"robot is {text!r}", count, MAX_COUNT)
    return [place_of(f"{first}-{each}") for each in range(1, number + 1)]


def downsampling(rates: Sequence[Rate], robots: Sequence[RobotPlace]) -> list[dict[str, Any]]:
    """Return Zenoh's `downsampling` settings for what leaves the router.

    A rule limits the total rate of all keys that it matches. If several rules match a key, Zenoh applies any
    of them. So if robots are listed, there is no rule for all robots: Zenoh might apply it to listed ones.
    """
    listed = {keys.within(place.namespace, f"{keys.PREFIX}/{place.robot}") for place in robots}
    rules = [f"{place}/{leaf}" for place in sorted(listed) or [keys.ANYWHERE] for leaf in REDUCED]
    return [
        {
            "id": f"rate {number}",
            **({"interfaces": [rate.interface]} if rate.interface else {}),
            "messages": ["put"],
            "flows": ["egress"],
            "rules": [{"key_expr": rule, "freq": rate.hz} for rule in rules],
        }
        for number, rate in enumerate(rates)
    ]

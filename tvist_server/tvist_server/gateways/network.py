"""One Zenoh session for all robots of the server: a router for clients, a client of a fleet's router, or both."""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import zenoh
from zenoh.handlers import Callback

from tvist_client.errors import NotConnectedError
from tvist_client.transports.certificates import settings as certificate_for
from tvist_client.transports.certificates import why_refused
from tvist_server.gateways.base import CommandIntake, GatewayError
from tvist_server.gateways.zenoh import ZenohGateway

CONFIG: Mapping[str, Any] = {
    "mode": "router",
    # Do not look for other routers: this would delay opening by half a second.
    "scouting/delay": 0,
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    # Shared memory, which Zenoh uses from 3 kB, would bypass every size limit.
    "transport/shared_memory/enabled": False,
    # By default, a hundred silent connections keep all other clients out for ten seconds.
    "transport/unicast/accept_timeout": 2000,
    "transport/unicast/accept_pending": 1000,
    # Each subscriber costs about 20 µs per state, so this many need several times the 2 ms of a tick.
    "transport/unicast/max_sessions": 256,
}
"""Zenoh settings of the session, by path."""
REALTIME: Mapping[str, Any] = {
    # Data beyond this send buffer, half a second of states, is dropped. By default the system buffers 3 MB,
    # and a client on a slow link would get states and answers that are half a minute old.
    "transport/link/tcp/so_sndbuf": 131_072,
    "transport/link/tls/so_sndbuf": 131_072,
    # In real time only answers wait for room, and each delays all later ones. A client that keeps asking but does
    # not read is disconnected after this time [µs] instead of 5 s.
    "transport/link/tx/queue/congestion_control/block/wait_before_close": 1_000_000,
    # The tick thread publishes and must not wait for room; by default it would for a millisecond.
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
    # An answer that waits blocks the queue of its query's priority on that link. Nothing is published with
    # this priority, so the tick thread never waits for a client that asks and does not read.
    "qos/network": [{"messages": ["query"], "flows": ["ingress"], "overwrite": {"priority": "data"}}],
}
"""Additional settings for a clock that does not wait for clients."""
CONNECT_S = 10
"""Longest time to reach a router at the start [s]. If a router is lost later, Zenoh retries without limit."""
CONNECT: Mapping[str, Any] = {
    "connect/timeout_ms": 1000 * CONNECT_S,
    "connect/exit_on_failure": True,
    "connect/retry": {"period_init_ms": 500, "period_max_ms": 4000, "period_increase_factor": 2},
}
"""Additional settings of a session that connects to a router."""


class Network:
    """Listens on endpoints and creates a gateway for each robot; GatewayError if that fails or no router answers."""

    def __init__(
        self,
        endpoints: Sequence[str],
        guard: Mapping[str, Any] = MappingProxyType({}),  # session settings that restrict access, by path
        *,
        lockstep: bool = True,  # whether a client advances time: the server waits for slow clients
        connect: Sequence[str] = (),  # routers; the first that answers is used
        security: str | None = None,  # folder with this robot's certificate for the router
        namespace: str = "",  # precedes all keys on the network
        on_router: Callable[[bool], None] | None = None,  # connected or lost; Zenoh's threads
        gossip: bool = False,  # whether clients learn of each other, as ROS 2 nodes must
    ) -> None:
        settings = guard if lockstep else {**REALTIME, **guard}
        settings = {**settings, "scouting/gossip/enabled": gossip}
        if namespace:
            settings = {**settings, "namespace": namespace}
        self.session = (
            _connected(connect, endpoints, settings, security) if connect else _open(endpoints, settings)
        )
        self._gateways: list[ZenohGateway] = []
        self._expected: dict[str, ZenohGateway] = {}
        self._closed = False
        self._on_router = on_router if connect else None
        self.session.info.declare_transport_events_listener(Callback(self._on_transport, indirect=False))
        _OPEN.add(self)

    def gateway(
        self,
        robot: str,
        intake: CommandIntake,
        *,
        lockstep: bool,
        truth: bool,
        wanted: Callable[[bool], None] | None = None,
    ) -> ZenohGateway:
        """Create a robot's gateway; in lockstep, its publishers wait for clients so that no state is lost.

        If `truth` is False, `wanted`, if given, is called from any thread with whether a client subscribes to
        the topic `truth`.
        """
        gateway = self._expected.pop(robot, None) or self._added(robot, intake)
        gateway.serve(intake, lockstep=lockstep, truth=truth, wanted=wanted)
        return gateway

    def expect(self, robots: Sequence[str], starting: CommandIntake, *, here: bool = True) -> None:
        """Let `starting` answer queries for robots until `gateway`, or another session (`here` False), serves them."""
        for robot in robots:
            self._expected[robot] = self._added(robot, starting, complete=here)

    def stop_answering_for_workers(self) -> None:
        """Stop answering for expected robots: Zenoh may ask this session although a worker could answer."""
        for gateway in self._expected.values():
            gateway.withdraw()

    def _added(self, robot: str, starting: CommandIntake, *, complete: bool = True) -> ZenohGateway:
        gateway = ZenohGateway(self.session, robot, starting, complete=complete)
        self._gateways.append(gateway)
        return gateway

    def close(self) -> None:
        """Close the session, so that every `alive` token disappears at once. A second call does nothing."""
        if self._closed:
            return
        self._closed = True
        for gateway in self._gateways:
            gateway.close()
        _OPEN.discard(self)
        self.session.close()  # type: ignore[no-untyped-call]

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        there = event.kind == zenoh.SampleKind.PUT
        if (
            self._on_router is not None
            and not self._closed
            and event.transport.whatami == zenoh.WhatAmI.ROUTER
        ):
            self._on_router(there)
        if not there:
            for gateway in tuple(self._gateways):
                gateway.session_gone(str(event.transport.zid))


def _open(endpoints: Sequence[str], settings: Mapping[str, Any]) -> zenoh.Session:
    try:
        return _session({**settings, "listen/endpoints": list(endpoints)})
    except zenoh.ZError as error:
        raise GatewayError(
            _explain(error, ", ".join(endpoint.partition("#")[0] for endpoint in endpoints))
        ) from error


def _connected(
    connect: Sequence[str], listen: Sequence[str], settings: Mapping[str, Any], security: str | None
) -> zenoh.Session:
    """Connect to a router as client, or as peer if clients connect here; a router would map all others."""
    mode = {"mode": "peer", "listen/endpoints": list(listen)} if listen else {"mode": "client"}
    try:
        return _session({**settings, **mode, **CONNECT, **_towards(connect, security)})
    except zenoh.ZError as error:
        if "listen" in str(error):
            raise GatewayError(_explain(error, ", ".join(listen))) from error
        refused = next(
            (why for endpoint in connect if (why := why_refused(endpoint, security, "router"))),
            f"no router answers within {CONNECT_S} s: check that it is running and listens there (`tvist router`)",
        )
        raise GatewayError(f"no connection to {', '.join(connect)}: {refused}") from error


def open_router(
    listen: Sequence[str], connect: Sequence[str], settings: Mapping[str, Any], security: str | None
) -> zenoh.Session:
    """Open a router's session, which connects to routers as they appear; GatewayError if it cannot listen."""
    retry = {"connect/retry": CONNECT["connect/retry"]}
    return _open(listen, {**settings, **retry, **_towards(connect, security)})


def _towards(connect: Sequence[str], security: str | None) -> dict[str, Any]:
    """Return the settings of a session that connects to routers: their endpoints and the certificate to present."""
    shown: dict[str, Any] = {"connect/endpoints": list(connect)}
    try:
        for endpoint in connect:
            shown |= certificate_for(endpoint, security)
    except NotConnectedError as error:
        raise GatewayError(str(error)) from error
    return shown


def _session(settings: Mapping[str, Any]) -> zenoh.Session:
    config = zenoh.Config()
    for path, value in {**CONFIG, **settings}.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def _explain(error: zenoh.ZError, endpoints: str) -> str:
    """Return Zenoh's reason in plain words, without the source locations that it appends."""
    cause = str(error)
    reasons = {
        "Address already in use": "the port is in use: stop the server that uses it, or choose another port",
        "Cannot assign requested address": "this machine does not have this address; use 0.0.0.0 for all its addresses",
        "Permission denied": "that is not permitted: choose a port above 1023",
        "failed to lookup": "there is no host of this name",
        "must be of the form": "an endpoint has the form tcp/<address>:<port>",
        "invalid port": "a port is a number up to 65535",
    }
    reason = next((reason for sign, reason in reasons.items() if sign in cause), cause.partition(" at /")[0])
    return f"cannot listen on {endpoints}: {reason}"


_OPEN: set[Network] = set()


def _close_all() -> None:
    for network in tuple(_OPEN):
        network.close()


# An open session can hang the process at its end. `atexit` runs too late: after threads were joined.
_register: Callable[[Callable[[], None]], None] = threading._register_atexit  # type: ignore[attr-defined]  # noqa: SLF001
_register(_close_all)

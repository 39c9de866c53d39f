"""The network: one Zenoh session, a router inside the server to which clients connect, for all its robots."""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import zenoh
from zenoh.handlers import Callback

from tvist_server.gateways.base import Desk, GatewayError
from tvist_server.gateways.zenoh import ZenohGateway

CONFIG: Mapping[str, Any] = {
    "mode": "router",
    # Nobody to look for: by default opening waits half a second for other routers.
    "scouting/delay": 0,
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    # A payload in shared memory passes every limit on size, and needs 3 kB to begin with.
    "transport/shared_memory/enabled": False,
    # By default a hundred connections that say nothing shut everybody else out for ten seconds.
    "transport/unicast/accept_timeout": 2000,
    "transport/unicast/accept_pending": 1000,
    # A state costs about 20 µs a subscriber: this many would use up the 2 ms of a tick several times.
    "transport/unicast/max_sessions": 256,
}
"""Zenoh settings of the session, by path."""
REALTIME: Mapping[str, Any] = {
    # What the system holds for a client beyond that is dropped, not late: half a second of states. By itself it
    # holds 3 MB, and a client on a slow link gets states and answers of half a minute ago.
    "transport/link/tcp/so_sndbuf": 131_072,
    "transport/link/tls/so_sndbuf": 131_072,
    # Answers alone wait for room in real time, and everybody's behind them: a client that goes on asking and has
    # stopped reading is cut off after this [us], instead of 5 s.
    "transport/link/tx/queue/congestion_control/block/wait_before_close": 1_000_000,
}
"""Besides, where time does not wait for clients."""


class Network:
    """Listens on endpoints; each robot has a gateway of its own there.

    Args:
        endpoints: Endpoints to listen on, such as `tcp/127.0.0.1:7447`.
        guard: Settings of the session that keep others out, path to value.
        lockstep: Whether a client lets time pass: then one that is slow is waited for.

    Raises:
        GatewayError: An endpoint cannot be listened on.
    """

    def __init__(
        self,
        endpoints: Sequence[str],
        guard: Mapping[str, Any] = MappingProxyType({}),
        *,
        lockstep: bool = True,
    ) -> None:
        self._session = _open(endpoints, guard if lockstep else {**REALTIME, **guard})
        self._gateways: list[ZenohGateway] = []
        self._closed = False
        self._session.info.declare_transport_events_listener(Callback(self._on_transport, indirect=False))
        _OPEN.add(self)

    def gateway(self, robot: str, desk: Desk, *, lockstep: bool, truth: bool) -> ZenohGateway:
        """Let clients reach a robot.

        Args:
            robot: Its name, which stands in every key.
            desk: Takes what arrives.
            lockstep: Whether a client lets time pass: then no state may be lost, and the publisher waits.
            truth: Whether to put the stream of what no robot can know.
        """
        gateway = ZenohGateway(self._session, robot, desk, lockstep=lockstep, truth=truth)
        self._gateways.append(gateway)
        return gateway

    def close(self) -> None:
        """Close the session; clients see every `alive` go at once. A second call does nothing."""
        if self._closed:
            return
        self._closed = True
        for gateway in self._gateways:
            gateway.close()
        _OPEN.discard(self)
        self._session.close()  # type: ignore[no-untyped-call]

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.DELETE:
            for gateway in tuple(self._gateways):
                gateway.session_gone(str(event.transport.zid))


def _open(endpoints: Sequence[str], guard: Mapping[str, Any]) -> zenoh.Session:
    config = zenoh.Config()
    try:
        for path, value in {**CONFIG, **guard, "listen/endpoints": list(endpoints)}.items():
            config.insert_json5(path, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise GatewayError(
            _explain(error, ", ".join(endpoint.partition("#")[0] for endpoint in endpoints))
        ) from error


def _explain(error: zenoh.ZError, endpoints: str) -> str:
    """Zenoh's reason in one sentence, without the places in its sources where it passed."""
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


# A session left open can hang the process at its end; `atexit` comes too late, after threads were joined.
_register: Callable[[Callable[[], None]], None] = threading._register_atexit  # type: ignore[attr-defined]  # noqa: SLF001
_register(_close_all)

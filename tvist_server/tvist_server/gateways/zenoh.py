"""The Zenoh gateway: a router inside the server, to which clients connect.

Callbacks run in Zenoh's own threads, directly (`indirect=False`): what one client sends is then handed on in
the order in which it was sent, a liveliness token before the command that follows it. They turn payloads into
bytes, hand them to the desk and return; one may still be running when the session is closed, hence the flag.
"""

import contextlib
import json
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

import zenoh
from zenoh.handlers import Callback

from tvist_protocol import keys
from tvist_protocol.codec import MAX_BYTES, encode
from tvist_protocol.replies import Refused
from tvist_server.gateways.base import Desk, Gateway, GatewayError, Reply, Topic
from tvist_server.gateways.replies import ENCODING, Answers

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
"""Of the session: path to value."""


class ZenohGateway(Gateway):
    """One robot on Zenoh.

    Args:
        robot: Its name, which stands in every key.
        endpoints: Where to listen, `tcp/127.0.0.1:7447`.
        desk: Takes what arrives.
        lockstep: Whether a client lets time pass: then no state may be lost, and the publisher waits.
        truth: Whether to put the stream of what no robot can know.
        guard: Settings of the session that keep others out, path to value.

    Raises:
        GatewayError: An endpoint cannot be listened on.
    """

    def __init__(
        self,
        robot: str,
        endpoints: Sequence[str],
        desk: Desk,
        *,
        lockstep: bool,
        truth: bool,
        guard: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self.setpoints_refused = 0
        """Set-points that never reached the desk: put on a key with a wildcard, or too large."""
        self._robot = robot
        self._desk = desk
        self._closed = False
        self._answers = Answers()
        try:
            self._session = _open(endpoints, guard)
        except GatewayError:
            self._answers.close()
            raise
        _OPEN.add(self)
        try:
            self._declare(lockstep=lockstep, truth=truth)
        except BaseException:
            self.close()
            raise

    def _declare(self, *, lockstep: bool, truth: bool) -> None:
        session, robot = self._session, self._robot
        session.liveliness().declare_subscriber(
            keys.any_client(robot), Callback(self._on_client, indirect=False), history=True
        )
        serve = {keys.command(robot): self._on_command, keys.info(robot): self._on_info}
        for key, handler in serve.items():
            session.declare_queryable(key, Callback(partial(handler, key), indirect=False), complete=True)
        setpoint = keys.setpoint(robot)
        session.declare_subscriber(setpoint, Callback(partial(self._on_setpoint, setpoint), indirect=False))
        self._publishers = _publishers(session, robot, lockstep=lockstep, truth=truth)
        # Last, since it says that everything else is there.
        self._alive = session.liveliness().declare_token(keys.alive(robot))

    def publish(self, topic: Topic, payload: bytes) -> None:
        """Put an encoded message; one of a topic that is not served goes nowhere."""
        publisher = self._publishers.get(topic)
        if publisher is not None and not self._closed:
            with contextlib.suppress(zenoh.ZError):  # the session is being closed
                publisher.put(payload)

    def close(self) -> None:
        """Close the session; clients see `alive` go at once."""
        if self._closed:
            return
        self._answers.close()
        self._closed = True
        _OPEN.discard(self)
        self._session.close()  # type: ignore[no-untyped-call]

    # ------------------------------------------------------------------ what arrives, in Zenoh's threads

    def _on_command(self, key: str, query: zenoh.Query) -> None:
        reply = self._reply(key, query)
        if reply is None:
            return
        payload = query.payload
        if payload is None:
            reply(_malformed("", "the query has no payload: a command is the payload of a query"))
        elif len(payload) > MAX_BYTES:
            why = f"the message has {len(payload)} bytes, at most {MAX_BYTES} are allowed"
            reply(_malformed("", why, MAX_BYTES))
        else:
            self._desk.request(payload.to_bytes(), reply)

    def _on_info(self, key: str, query: zenoh.Query) -> None:
        reply = self._reply(key, query)
        if reply is not None:
            self._desk.info(reply)

    def _reply(self, key: str, query: zenoh.Query) -> Reply | None:
        """How to answer; None where there is nothing to do any more."""
        if self._closed:
            query.drop()  # type: ignore[no-untyped-call]
            return None
        reply = self._answers.to(query, key)
        asked = str(query.key_expr)
        if asked != key:
            reply(_malformed("key", f"key is {asked:.80}, which has a wildcard: ask on {key}"))
            return None
        return reply

    def _on_setpoint(self, key: str, sample: zenoh.Sample) -> None:
        if self._closed:
            return
        if str(sample.key_expr) != key or len(sample.payload) > MAX_BYTES:
            self.setpoints_refused += 1
        else:
            self._desk.setpoint(sample.payload.to_bytes())

    def _on_client(self, sample: zenoh.Sample) -> None:
        name = keys.client_name(self._robot, str(sample.key_expr))
        if self._closed or name is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._desk.client_seen(name)
        else:
            self._desk.client_gone(name)


def _publishers(
    session: zenoh.Session, robot: str, *, lockstep: bool, truth: bool
) -> dict[Topic, zenoh.Publisher]:
    """One publisher a topic.

    In real time nothing may hold up the publisher, so everything is DROP. States go express, one batch each.
    An event must not be lost all the same: events have a priority, hence queues, of their own, and are not
    express, so that two batches of 64 KiB, about a thousand events, wait for a client that has stopped
    reading, on top of what its socket holds. Measured with a reader stopped for 7.5 s under more states than
    its socket holds: 3300 of 6000 states were dropped and none of 240 events; half of the events, had they
    been express or of the states' priority. BLOCK would have held up the publisher, and with it every other
    client, for 5 s.

    In lockstep everything is BLOCK, as the protocol has it, and events share the states' queue: who reads
    state `n` has read every event up to tick `n`.
    """
    block, drop = zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP
    realtime, high = zenoh.Priority.REAL_TIME, zenoh.Priority.INTERACTIVE_HIGH
    control = block if lockstep else drop

    def declare(key: str, priority: zenoh.Priority, *, express: bool) -> zenoh.Publisher:
        return session.declare_publisher(
            key, encoding=ENCODING, congestion_control=control, priority=priority, express=express
        )

    publishers: dict[Topic, zenoh.Publisher] = {
        "state": declare(keys.state(robot), realtime, express=True),
        "event": declare(keys.event(robot), realtime if lockstep else high, express=lockstep),
        "telemetry": declare(keys.telemetry(robot), zenoh.Priority.DATA, express=False),
    }
    if truth:
        publishers["truth"] = declare(keys.truth(robot), realtime, express=True)
    return publishers


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
        "Address already in use": "the port is in use: stop the server that has it or take another port",
        "Cannot assign requested address": "this machine has no such address; 0.0.0.0 stands for all it has",
        "Permission denied": "that is not permitted: take a port above 1023",
        "failed to lookup": "there is no host of that name",
        "must be of the form": "an endpoint has the form tcp/<address>:<port>",
        "invalid port": "a port is a number up to 65535",
    }
    reason = next((reason for sign, reason in reasons.items() if sign in cause), cause.partition(" at /")[0])
    return f"cannot listen on {endpoints}: {reason}"


def _malformed(where: str, why: str, limit: float | None = None) -> bytes:
    return encode(Refused(code="malformed", where=where, why=why, limit=limit))


_OPEN: set[ZenohGateway] = set()


def _close_all() -> None:
    for gateway in tuple(_OPEN):
        gateway.close()


# A session left open can hang the process at its end; `atexit` comes too late, after threads were joined.
_register: Callable[[Callable[[], None]], None] = threading._register_atexit  # type: ignore[attr-defined]  # noqa: SLF001
_register(_close_all)

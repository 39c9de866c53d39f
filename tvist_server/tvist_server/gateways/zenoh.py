"""The Zenoh gateway: one robot's keys on the server's session.

Callbacks run in Zenoh's own threads, directly (`indirect=False`): what one client sends is then handed on in
the order in which it was sent, a liveliness token before the command that follows it. They turn payloads into
bytes, hand them to the desk and return; one may still be running when the session is closed, hence the flag.
"""

import contextlib
from collections.abc import Callable
from functools import partial

import zenoh
from zenoh.handlers import Callback

from tvist_controller.sink import Topic
from tvist_protocol import keys
from tvist_protocol.codec import MAX_BYTES
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.base import Desk, Gateway, Message
from tvist_server.gateways.replies import ENCODING, Answers


class ZenohGateway(Gateway):
    """One robot on Zenoh. `Network.gateway` makes one.

    Args:
        session: An open session, which closes after this.
        robot: The robot's name, which stands in every key.
        desk: Takes what arrives.
        lockstep: Whether a client lets time pass: then no state may be lost, and the publisher waits.
        truth: Whether to put the stream of what no robot can know.
    """

    def __init__(
        self, session: zenoh.Session, robot: str, desk: Desk, *, lockstep: bool, truth: bool
    ) -> None:
        self.setpoints_refused = 0
        self._session = session
        self._robot = robot
        self._desk = desk
        self._closed = False
        self._answers = Answers()
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

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  it is encoded
        """Put an encoded message; one of a topic that is not served goes nowhere."""
        publisher = self._publishers.get(topic)
        if publisher is not None and not self._closed:
            with contextlib.suppress(zenoh.ZError):  # the session is being closed
                publisher.put(payload)

    def close(self) -> None:
        """Answer nothing any more. What is declared goes with the session."""
        if not self._closed:
            self._answers.close()
            self._closed = True

    # ------------------------------------------------------------------ what arrives, in Zenoh's threads

    def _on_command(self, key: str, query: zenoh.Query) -> None:
        answer = self._answer(key, query)
        if answer is None:
            return
        payload = query.payload
        if payload is None:
            answer(_malformed("", "the query has no payload: a command is the payload of a query"))
        elif len(payload) > MAX_BYTES:
            why = f"the message has {len(payload)} bytes, at most {MAX_BYTES} are allowed"
            answer(_malformed("", why, MAX_BYTES))
        else:
            self._desk.request(payload.to_bytes(), answer)

    def _on_info(self, key: str, query: zenoh.Query) -> None:
        answer = self._answer(key, query)
        if answer is not None:
            self._desk.info(answer)

    def _answer(self, key: str, query: zenoh.Query) -> Callable[[Reply | bytes], None] | None:
        """How to answer; None where there is nothing to do any more."""
        if self._closed:
            query.drop()  # type: ignore[no-untyped-call]
            return None
        answer = self._answers.to(query, key)
        asked = str(query.key_expr)
        if asked != key:
            answer(_malformed("key", f"key is {asked:.80}, which has a wildcard: ask on {key}"))
            return None
        return answer

    def _on_setpoint(self, key: str, sample: zenoh.Sample) -> None:
        if self._closed:
            return
        if str(sample.key_expr) != key or len(sample.payload) > MAX_BYTES:
            self.setpoints_refused += 1
        else:
            self._desk.setpoint(sample.payload.to_bytes())

    def _on_client(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        name, session = keys.client_name(self._robot, key), keys.client_session(self._robot, key)
        if self._closed or name is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._desk.client_seen(name, session)
        else:
            self._desk.client_gone(name, session)

    def session_gone(self, session: str) -> None:
        """Hear that a session has ended: its liveliness tokens go only with their last copy, wherever that is."""
        if not self._closed:
            self._desk.session_gone(session)


def _publishers(
    session: zenoh.Session, robot: str, *, lockstep: bool, truth: bool
) -> dict[Topic, zenoh.Publisher]:
    """One publisher a topic.

    In real time nothing may hold up the publisher, so everything is DROP, and nothing is express: then what
    finds the link busy shares a batch of 64 KiB, and of those two may wait. Express, each message has a batch
    of its own, and two states were all that could wait: on two cores with eight busy processes besides, a
    client that read as fast as it could got 2330 of 3000 states, not express all of them, and none later.

    What comes every tick has a low priority: on a link that is too slow for it, answers, events and telemetry
    go first. With the priority of real time, and a link for a fifth of the states, no answer came through.

    An event must not be lost at all: events have a priority, hence queues, of their own, so that about a
    thousand wait for a client that has stopped reading, on top of what its socket holds. Measured with a reader
    stopped for 7.5 s under more states than its socket holds: 3300 of 6000 states were dropped and none of
    240 events; half of the events, had they been of the states' priority. BLOCK would have held up the
    publisher, and with it every other client, for 5 s.

    In lockstep everything is BLOCK, as the protocol has it, and events share the states' queue: who reads
    state `n` has read every event up to tick `n`.
    """
    control = zenoh.CongestionControl.BLOCK if lockstep else zenoh.CongestionControl.DROP
    every_tick = zenoh.Priority.REAL_TIME if lockstep else zenoh.Priority.DATA_LOW
    event = zenoh.Priority.REAL_TIME if lockstep else zenoh.Priority.INTERACTIVE_HIGH

    def declare(key: str, priority: zenoh.Priority) -> zenoh.Publisher:
        return session.declare_publisher(
            key, encoding=ENCODING, congestion_control=control, priority=priority, express=lockstep
        )

    publishers: dict[Topic, zenoh.Publisher] = {
        "state": declare(keys.state(robot), every_tick),
        "event": declare(keys.event(robot), event),
        "telemetry": declare(keys.telemetry(robot), zenoh.Priority.DATA),
        "io": declare(keys.io(robot), event),
    }
    if truth:
        publishers["truth"] = declare(keys.truth(robot), every_tick)
    return publishers


def _malformed(where: str, why: str, limit: float | None = None) -> Refused:
    return Refused(code="malformed", where=where, why=why, limit=limit)

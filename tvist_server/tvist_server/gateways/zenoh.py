"""The Zenoh gateway: one robot's keys on the server's session.

Callbacks run in Zenoh's threads (`indirect=False`), so that one client's messages are handled in order: a
liveliness token before the command that follows it. `_closed` is set because a callback may still run while
the session closes.
"""

import contextlib
import logging
import threading
from collections.abc import Callable
from functools import partial
from queue import SimpleQueue

import zenoh
from zenoh.handlers import Callback

from tvist_controller.instruments.report import Report, Topic
from tvist_protocol import keys
from tvist_protocol.codec import MAX_BYTES, encode
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.base import CommandIntake, Gateway, Message

log = logging.getLogger(__name__)

ENCODING = zenoh.Encoding("application/msgpack")
CLOSE_WAIT = 0.2  # longest time to send the last answers at close [s]
EVERY_TICK: frozenset[Topic] = frozenset({"state", "truth"})
"""Topics published every tick; their messages are made only for subscribers."""


class ZenohGateway(Gateway):
    """One robot on Zenoh; `starting` answers queries until `serve`. Close the session after this gateway.

    If `complete` is False, queries need not come here if another session answers them.
    """

    def __init__(
        self, session: zenoh.Session, robot: str, starting: CommandIntake, *, complete: bool = True
    ) -> None:
        self._session = session
        self._robot = robot
        self._intake = self._queried = starting
        self._closed = False
        self.wanted_topics: set[Topic] = set()
        self._answers = Answers()
        serve = {keys.key(robot, "command"): self._on_command, keys.key(robot, "info"): self._on_info}
        self._queryables = [
            session.declare_queryable(key, Callback(partial(handler, key), indirect=False), complete=complete)
            for key, handler in serve.items()
        ]

    def withdraw(self) -> None:
        for queryable in self._queryables:
            queryable.undeclare()  # type: ignore[no-untyped-call]

    def serve(
        self,
        intake: CommandIntake,
        *,
        lockstep: bool,
        truth: bool,
        wanted: Callable[[bool], None] | None = None,
    ) -> None:
        """Let clients reach the robot; arguments as for `Network.gateway`."""
        session, robot = self._session, self._robot
        self._intake = intake
        session.liveliness().declare_subscriber(
            keys.any_client(robot), Callback(self._on_client, indirect=False), history=True
        )
        self._queried = intake  # from here on, the intake knows the clients
        setpoint = keys.key(robot, "setpoint")
        session.declare_subscriber(setpoint, Callback(partial(self._on_setpoint, setpoint), indirect=False))
        self._publishers = _publishers(session, robot, lockstep=lockstep, truth=truth or wanted is not None)
        self.wanted_topics = set(self._publishers)
        # In lockstep a client must not miss the tick that it requests right after subscribing.
        if not lockstep:
            for topic in EVERY_TICK & self.wanted_topics:
                self.wanted_topics.discard(topic)
                self._listen(topic, partial(self._on_wanted, topic))
        if wanted is not None:
            self._listen("truth", wanted)
        # Declared last, because it announces that everything else is ready.
        self._alive = session.liveliness().declare_token(keys.key(robot, "alive"))

    def report(self, report: Report) -> None:
        self._put("state", report.encoded)

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  it is already encoded
        self._put(topic, payload)

    def _put(self, topic: Topic, payload: bytes) -> None:
        publisher = self._publishers.get(topic)
        if publisher is not None and not self._closed:
            with contextlib.suppress(zenoh.ZError):  # the session is being closed
                publisher.put(payload)

    def close(self) -> None:
        """Stop answering. The declarations end with the session."""
        if not self._closed:
            self._answers.close()
            self._closed = True

    # The following methods run in Zenoh's threads.

    def _listen(self, topic: Topic, tell: Callable[[bool], None]) -> None:
        """Call `tell` with whether a topic has subscribers: now if there are any, then at every change."""

        def on_matching(status: zenoh.MatchingStatus) -> None:
            tell(status.matching)

        self._publishers[topic].declare_matching_listener(Callback(on_matching, indirect=False))

    def _on_wanted(self, topic: Topic, wanted: bool) -> None:
        if wanted:
            self.wanted_topics.add(topic)
        else:
            self.wanted_topics.discard(topic)

    def _on_command(self, key: str, query: zenoh.Query) -> None:
        answer = self._answer(key, query)
        if answer is None:
            return
        payload = query.payload
        if payload is None:
            answer(_malformed("", "the query has no payload: a command is the payload of a query"))
        elif len(payload) > MAX_BYTES:
            why = f"the message has {len(payload)} bytes: must have at most {MAX_BYTES}"
            answer(_malformed("", why, MAX_BYTES))
        else:
            self._queried.request(payload.to_bytes(), answer)

    def _on_info(self, key: str, query: zenoh.Query) -> None:
        answer = self._answer(key, query)
        if answer is not None:
            self._queried.info(answer)

    def _answer(self, key: str, query: zenoh.Query) -> Callable[[Reply | Callable[[], bytes]], None] | None:
        """Return the function that answers a query; None if the gateway is closed or the key has a wildcard."""
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
            self._intake.setpoint(sample.payload.to_bytes())

    def _on_client(self, sample: zenoh.Sample) -> None:
        client = keys.client_of(self._robot, str(sample.key_expr))
        if self._closed or client is None:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._intake.client_seen(*client)
        else:
            self._intake.client_gone(*client)

    def session_gone(self, session: str) -> None:
        """Note that a session has ended. Its liveliness tokens may outlast it while another session holds a copy."""
        if not self._closed:
            self._intake.session_gone(session)


class Answers:
    """Sends replies to queries from its own thread, because a client that does not read blocks that thread.

    The thread blocks until Zenoh closes the client's link, after 1 s in real time or 5 s in lockstep.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[tuple[zenoh.Query, str, Reply | Callable[[], bytes]] | None] = SimpleQueue()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="zenoh-answers", daemon=True)
        self._thread.start()

    def to(self, query: zenoh.Query, key: str) -> Callable[[Reply | Callable[[], bytes]], None]:
        """Return a function that answers a query with a reply, or with a function that returns an encoded one."""
        return lambda reply: self._queue.put((query, key, reply))

    def close(self) -> None:
        """Send the queued answers, for at most `CLOSE_WAIT`."""
        self._queue.put(None)
        self._thread.join(CLOSE_WAIT)
        self._closed = True

    def _run(self) -> None:
        while not self._closed and (answer := self._queue.get()) is not None:
            try:
                _send(*answer)
            except Exception:
                log.exception("a query is not answered")


def _send(query: zenoh.Query, key: str, reply: Reply | Callable[[], bytes]) -> None:
    # Leaving this block ends the query; if the client has left, the answer is not needed.
    with contextlib.suppress(zenoh.ZError), query:
        query.reply(key, reply() if callable(reply) else encode(reply), encoding=ENCODING)


def _publishers(
    session: zenoh.Session, robot: str, *, lockstep: bool, truth: bool
) -> dict[Topic, zenoh.Publisher]:
    """Declare one publisher for each topic.

    In real time nothing may block the publisher, so all publishers use DROP, and none is express: of messages
    that share batches of 64 KiB more can wait for a busy link. Messages of every tick have a low priority, so that
    on a slow link answers, events and telemetry come first: with real-time priority, no answer arrived. Events must
    not be lost, so they have a priority, and hence queues, of their own: about a thousand can wait for a client that
    has stopped reading, besides its socket's buffers.

    In lockstep all publishers use BLOCK, as the protocol requires, and events share the states' queue: a
    client that reads state `n` has read all events up to tick `n`.
    """
    control = zenoh.CongestionControl.BLOCK if lockstep else zenoh.CongestionControl.DROP
    every_tick = zenoh.Priority.REAL_TIME if lockstep else zenoh.Priority.DATA_LOW
    event = zenoh.Priority.REAL_TIME if lockstep else zenoh.Priority.INTERACTIVE_HIGH

    priorities: dict[Topic, zenoh.Priority] = {
        "state": every_tick,
        "event": event,
        "telemetry": zenoh.Priority.DATA_HIGH,  # in real time nothing shares the priority of answers, see `REALTIME`
        "io": event,
    }
    if truth:
        priorities["truth"] = every_tick
    return {
        topic: session.declare_publisher(
            keys.key(robot, topic),
            encoding=ENCODING,
            congestion_control=control,
            priority=priority,
            express=lockstep,
        )
        for topic, priority in priorities.items()
    }


def _malformed(where: str, why: str, limit: float | None = None) -> Refused:
    return Refused(code="malformed", where=where, why=why, limit=limit)

"""A ROS 2 node over Zenoh, which speaks the protocol of rmw_zenoh without an installed ROS 2."""

import asyncio
import threading
import time
from collections.abc import Callable
from functools import partial
from hashlib import blake2b
from itertools import count
from struct import Struct
from typing import Any

import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from tvist_client.errors import NotConnectedError
from tvist_client.transports.inbox import wake
from tvist_client.transports.session import close_session, open_session
from tvist_ros2.cdr import CdrError, decode, encode
from tvist_ros2.messages import RosType
from tvist_ros2.names import DEFAULT, Kind, Qos, Tokens, absolute, key
from tvist_ros2.node import Answer, Node
from tvist_ros2.tasks import Tasks

ATTACHMENT = Struct("<qqB16s")
"""Attachment of a message: its number, the time [ns], the length of the publisher's identifier, the identifier."""
SEEN_S = 5.0  # longest time until others at the router see a node [s]


class ZenohNode(Node):
    """A node in a session of its own, created by `open`."""

    def __init__(
        self, session: zenoh.Session, domain: int, namespace: str, name: str, *, lossless: bool
    ) -> None:
        self._session, self._domain, self._namespace = session, domain, namespace
        self._tokens = Tokens(domain, str(session.info.zid()), namespace, name)
        self._congestion = zenoh.CongestionControl.BLOCK if lossless else zenoh.CongestionControl.DROP
        self._loop = asyncio.get_running_loop()
        self._answering = Tasks()
        self.token = self._tokens.node()
        # Zenoh withdraws what is no longer referenced.
        self._kept: list[object] = [session.liveliness().declare_token(self.token)]

    @classmethod
    async def open(
        cls, endpoint: str, domain: int, namespace: str, name: str, *, lossless: bool = False
    ) -> "ZenohNode":
        """Connect to a Zenoh router; with `lossless`, publishers wait for subscribers.

        NotConnectedError if no router answers, or if its rules of access drop the messages of ROS 2.
        """
        session = await asyncio.to_thread(open_session, endpoint)
        node = cls(session, domain, namespace, name, lossless=lossless)
        if not await asyncio.to_thread(_seen_from_outside, endpoint, node.token):
            await node.close()
            why = "start it as tvist serve --ros2, or give the endpoint of rmw_zenohd"
            raise NotConnectedError(f"the router at {endpoint} does not pass on messages of ROS 2: {why}")
        return node

    def publisher(self, name: str, of: RosType, qos: Qos = DEFAULT) -> Callable[[Any], None]:
        where = self._key(name, of)
        publisher: zenoh.Publisher | zenoh.ext.AdvancedPublisher
        if qos.latched:
            publisher = zenoh.ext.declare_advanced_publisher(
                self._session,
                where,
                congestion_control=self._congestion,
                cache=zenoh.ext.CacheConfig(qos.depth),
                # Number the messages, because the session has no timestamps.
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
                publisher_detection=True,
            )
        else:
            publisher = self._session.declare_publisher(where, congestion_control=self._congestion)
        self._kept.append(publisher)
        token = self._announce("MP", name, of, qos)
        numbers, identifier = count(1), blake2b(token.encode(), digest_size=16).digest()
        return lambda message: publisher.put(
            encode(message), attachment=_attachment(next(numbers), identifier)
        )

    def subscribe(self, name: str, of: RosType, callback: Callable[[Any], None]) -> None:
        where = self._key(name, of)

        def on_sample(sample: zenoh.Sample) -> None:
            # Others may put on a key with a wildcard, which arrives here too.
            if str(sample.key_expr) == where:
                wake(self._loop, partial(self.deliver, name, of, callback, sample.payload.to_bytes()))

        self._kept.append(self._session.declare_subscriber(where, Callback(on_sample, indirect=False)))
        self._announce("MS", name, of)

    def serve(self, name: str, of: RosType, answer: Answer) -> None:
        where = self._key(name, of)

        async def respond(query: zenoh.Query) -> None:
            with query:
                try:
                    number, identifier = _attached(query)
                    request = decode(of.request, bytes(query.payload or b""))
                except CdrError as error:
                    self.warn(f"an invalid request to {name}: {error}")
                    query.reply_err(str(error))
                    return
                response = encode(await answer(request))
                query.reply(where, response, attachment=_attachment(number, identifier))

        def on_query(query: zenoh.Query) -> None:
            # A key with a wildcard would call several services at once.
            if str(query.key_expr) == where:
                wake(self._loop, lambda: self._answering.start(respond(query)))

        self._kept.append(
            self._session.declare_queryable(where, Callback(on_query, indirect=False), complete=True)
        )
        self._announce("SS", name, of)

    async def close(self) -> None:
        await self._answering.cancel()
        await asyncio.to_thread(close_session, self._session)

    def _key(self, name: str, of: RosType) -> str:
        return key(self._domain, absolute(self._namespace, name), of)

    def _announce(self, kind: Kind, name: str, of: RosType, qos: Qos = DEFAULT) -> str:
        token = self._tokens.entity(kind, absolute(self._namespace, name), of, qos)
        self._kept.append(self._session.liveliness().declare_token(token))
        return token


def _seen_from_outside(endpoint: str, token: str) -> bool:
    """Return whether another session at the router sees a node's token."""
    other, seen = open_session(endpoint), threading.Event()
    try:
        watch: Callback[zenoh.Sample] = Callback(lambda _: seen.set(), indirect=False)
        _watching = other.liveliness().declare_subscriber(token, watch, history=True)
        return seen.wait(SEEN_S)
    finally:
        close_session(other)


def _attached(query: zenoh.Query) -> tuple[int, bytes]:
    """Return the client's number and identifier, which the reply repeats, or raise CdrError."""
    data = bytes(query.attachment or b"")
    if len(data) != ATTACHMENT.size:
        raise CdrError(f"the attachment has {len(data)} bytes: must have {ATTACHMENT.size}")
    number, _, _, identifier = ATTACHMENT.unpack(data)
    return number, identifier


def _attachment(number: int, identifier: bytes) -> bytes:
    return ATTACHMENT.pack(number, time.time_ns(), len(identifier), identifier)  # noqa: TID251  ROS time

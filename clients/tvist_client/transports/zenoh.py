"""A robot on the network, over Zenoh.

Callbacks run in Zenoh's own threads (`indirect=False`), so that messages keep their order across topics and no Python
thread has to be joined. They only convert payloads to bytes.
"""

import asyncio
import re
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import zenoh
from zenoh.handlers import Callback

from tvist_client.errors import (
    AnswerTimeoutError,
    ClientError,
    DeniedError,
    NotConnectedError,
    UnexpectedReplyError,
)
from tvist_client.transports.base import Topic, Transport
from tvist_client.transports.certificates import Folder
from tvist_client.transports.inbox import Inbox, wake
from tvist_client.transports.session import close_session, open_session
from tvist_protocol import keys

ENCODING = zenoh.Encoding("application/msgpack")
FIND_S = 1.0
"""Time after which the present robots are queried, once there is a link [s]; a robot appears within milliseconds."""
LATE_S = 3.0
"""Time after which they are queried again if none answered, because the machine may be busy [s]."""
INFO_S = 10.0
"""Longest wait for `info` [s]."""


class ZenohTransport(Transport):
    """A connection to one robot over Zenoh, created by `open`."""

    def __init__(self, session: zenoh.Session, endpoint: str, robot: str, namespace: str = "") -> None:
        self._session = session
        self._endpoint = endpoint
        self._robot = robot
        self._namespace = namespace
        self._loop = asyncio.get_running_loop()
        self._mailbox = Inbox(self._loop)
        self._alive, self._losses = asyncio.Event(), 0
        self._closed = False
        self._pending: set[asyncio.Future[bytes]] = set()
        self._lost_callbacks: list[Callable[[NotConnectedError], None]] = []
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._announced: Counter[str] = Counter()
        session.liveliness().declare_subscriber(
            keys.key(robot, "alive"), Callback(self._on_alive, indirect=False), history=True
        )
        self._setpoints = session.declare_publisher(
            keys.key(robot, "setpoint"), encoding=ENCODING, priority=zenoh.Priority.REAL_TIME, express=True
        )

    @classmethod
    async def open(
        cls, endpoint: str, robot: str, security: Folder | None = None, namespace: str = ""
    ) -> "ZenohTransport":
        """Connect to an endpoint and find the robot there.

        Args:
            endpoint: Endpoint of the server, `tcp/127.0.0.1:7447`.
            robot: Name of the robot.
            security: Folder with this client's certificate, for `tls/<host>:<port>`.
            namespace: Namespace of the robot.

        Raises:
            NotConnectedError: No server listens there, or there is no visible robot of that name.
            ProtocolError: `robot` is not a valid robot name, or `namespace` not a valid namespace.
        """
        keys.check_robot_name(robot)
        session = await _opened(endpoint, security, namespace)
        transport = cls(session, endpoint, robot, namespace)
        try:
            await transport._find()
        except BaseException:
            await transport.close()
            raise
        return transport

    @property
    def dropped(self) -> int:
        """Number of messages dropped because the event loop was busy for too long."""
        return self._mailbox.dropped

    async def request(self, data: bytes, timeout_s: float) -> bytes:
        """Send a command as a query and wait for the reply."""
        losses = self._losses
        try:
            return await self._get(keys.key(self._robot, "command"), data, timeout_s)
        except NotConnectedError:
            # If the robot was present all the time and still answers, access control has dropped the command.
            if self._endpoint.startswith("tls/") and self._alive.is_set():
                await self.info()
                if self._losses == losses:
                    raise DeniedError(
                        f"robot {self._robot!r} at {self._endpoint} takes no commands from this client, which may only "
                        "watch: use an operator's certificate (`tvist keys --operator`)"
                    ) from None
            raise

    def put_setpoint(self, data: bytes) -> None:
        """Put a set-point; this takes 20 µs, and the set-point is dropped if the link is congested."""
        if self._closed:
            raise self._gone()
        self._setpoints.put(data)

    async def info(self) -> bytes:
        return await self._get(keys.key(self._robot, "info"), None, INFO_S)

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        if self._closed:
            raise self._gone()
        key = keys.key(self._robot, topic)
        droppable = topic in {"state", "truth"}

        def on_sample(sample: zenoh.Sample) -> None:
            # Other clients may put on a key with a wildcard, which arrives here too.
            if str(sample.key_expr) == key:
                self._mailbox.put(callback, sample.payload.to_bytes(), droppable=droppable)

        self._session.declare_subscriber(key, Callback(on_sample, indirect=False))

    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Call a function when the robot's liveliness token disappears."""
        self._lost_callbacks.append(callback)

    async def announce(self, client: str) -> None:
        """Declare the client's liveliness token. It reaches the robot before any command sent later."""
        if self._closed:
            raise self._gone()
        self._announced[client] += 1
        if client not in self._tokens:
            key = keys.client(self._robot, client, str(self._session.info.zid()))
            self._tokens[client] = self._session.liveliness().declare_token(key)

    async def withdraw(self, client: str) -> None:
        """Undeclare the client's liveliness token, once it was withdrawn as often as announced."""
        self._announced[client] -= 1
        if self._announced[client] > 0:
            return
        del self._announced[client]
        token = self._tokens.pop(client, None)
        if token is not None and not self._closed:
            token.undeclare()  # type: ignore[no-untyped-call]

    async def close(self) -> None:
        """Close the session; pending requests fail."""
        if self._closed:
            return
        self._closed = True
        self._fail_pending(self._gone())
        await asyncio.to_thread(close_session, self._session)

    async def _get(self, key: str, data: bytes | None, timeout_s: float) -> bytes:
        """Query one key and return the first answer.

        Zenoh ends a query that reaches no queryable silently at once, and an unanswered one with an error at its
        timeout.
        """
        if self._closed:
            raise self._gone()
        answer: asyncio.Future[bytes] = self._loop.create_future()
        self._pending.add(answer)
        nobody = NotConnectedError(
            f"robot {self._robot!r} at {self._endpoint} does not answer: check that the server is still running"
        )

        def on_reply(reply: zenoh.Reply) -> None:
            wake(self._loop, partial(_settle, answer, self._outcome(reply, timeout_s)))

        def on_end() -> None:
            wake(self._loop, partial(_settle, answer, nobody))

        try:
            # With the default quality of service, states have another queue and cannot delay answers.
            self._session.get(
                key,
                Callback(on_reply, on_end, indirect=False),
                payload=data,
                encoding=ENCODING if data is not None else None,
                timeout=timeout_s,
            )
            return await answer
        except zenoh.ZError as error:
            raise self._gone() from error
        finally:
            self._pending.discard(answer)

    def _outcome(self, reply: zenoh.Reply, timeout_s: float) -> bytes | ClientError:
        if reply.ok is not None:
            return reply.ok.payload.to_bytes()
        why = reply.err.payload.to_bytes() if reply.err is not None else b""
        if why == b"Timeout":
            return AnswerTimeoutError(
                f"robot {self._robot!r} at {self._endpoint} did not answer within {timeout_s:g} s: "
                "it hangs, or needs more time"
            )
        return UnexpectedReplyError(f"the answer is an error instead of a message: {why!r:.80}")

    def _on_alive(self, sample: zenoh.Sample) -> None:
        there = sample.kind == zenoh.SampleKind.PUT
        wake(self._loop, self._alive.set if there else self._lose)

    def _lose(self) -> None:
        self._alive.clear()
        self._losses += 1
        if self._closed:
            return
        error = self._gone()
        self._fail_pending(error)
        for callback in tuple(self._lost_callbacks):
            callback(error)

    def _gone(self) -> NotConnectedError:
        if self._closed:
            return NotConnectedError("the connection is closed: open another one")
        return NotConnectedError(
            f"robot {self._robot!r} at {self._endpoint} is gone: this client reconnects when it is back"
        )

    def _fail_pending(self, error: ClientError) -> None:
        for answer in tuple(self._pending):
            _settle(answer, error)

    async def _find(self) -> None:
        robots: list[str] = []
        for seconds in (FIND_S, LATE_S - FIND_S):
            with suppress(TimeoutError):
                async with asyncio.timeout(seconds):
                    await self._alive.wait()
                return
            robots = await _robots(self._session)
            if self._robot in robots:  # it appeared late because the machine is slow
                return
            with suppress(NotConnectedError):  # it has no token while it starts, but answers
                await self.info()
                return
            if robots:
                break
        there = f"the robots there are {', '.join(robots)}" if robots else f"none answered in {LATE_S:g} s"
        # Access control denies silently, too.
        secured = ", and that the robot lists the name of this certificate"
        where, what = (
            (f"{self._endpoint} in namespace {self._namespace}", "name, namespace and endpoint")
            if self._namespace
            else (self._endpoint, "name and endpoint")
        )
        check = f"check {what}{secured if self._endpoint.startswith('tls/') else ''}"
        raise NotConnectedError(f"no robot {self._robot!r} at {where}; {there}: {check}")


async def robots_at(endpoint: str, security: Folder | None = None, namespace: str = "") -> list[str]:
    """Return the names of the robots at an endpoint, sorted."""
    session = await _opened(endpoint, security, namespace)
    try:
        return await _robots(session)
    finally:
        await asyncio.to_thread(close_session, session)


async def only_robot(endpoint: str, wanted: str, security: Folder | None = None, namespace: str = "") -> str:
    """Choose a robot if no name is given: the preferred one, or if that is absent, the only one."""
    robots = await robots_at(endpoint, security, namespace)
    if wanted in robots or not robots:
        return wanted
    if len(robots) > 1:
        why = f"there are several robots at {endpoint}, {', '.join(robots)}: choose one with --name"
        raise NotConnectedError(why)
    return robots[0]


async def _opened(endpoint: str, security: Folder | None, namespace: str) -> zenoh.Session:
    """Open a session; if this is cancelled, close it again, because a server has few places."""
    opening = asyncio.create_task(asyncio.to_thread(open_session, endpoint, security, namespace))
    try:
        return await asyncio.shield(opening)
    except asyncio.CancelledError:
        with suppress(NotConnectedError):
            await asyncio.to_thread(close_session, await opening)
        raise


async def _robots(session: zenoh.Session) -> list[str]:
    """Return the names of the reachable robots, in natural order: ur5e-2 before ur5e-10."""
    loop = asyncio.get_running_loop()
    names: list[str] = []
    ended = asyncio.Event()

    def on_reply(reply: zenoh.Reply) -> None:
        if reply.ok is not None and (place := keys.place(str(reply.ok.key_expr))) is not None:
            names.append(place[1])

    session.liveliness().get(
        keys.ANY_ALIVE, Callback(on_reply, partial(wake, loop, ended.set), indirect=False), timeout=INFO_S
    )
    await ended.wait()
    return sorted(names, key=natural)


def natural(name: str) -> list[int | str]:
    """Return a sort key for names, in which digits count as numbers."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def _settle(answer: asyncio.Future[bytes], outcome: bytes | ClientError) -> None:
    """Set the result of a request, unless it has one already."""
    if answer.done():
        return
    if isinstance(outcome, bytes):
        answer.set_result(outcome)
    else:
        answer.set_exception(outcome)

"""A robot on the network, over Zenoh.

Callbacks run in Zenoh's own threads (`indirect=False`), so that messages keep their order across topics and no Python
thread has to be joined. They only convert payloads to bytes.
"""

import asyncio
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
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
from tvist_client.transports.session import ENCODING, ask, close_session, open_session
from tvist_protocol import keys

FIND_S = 1.0
"""Time after the link is open at which robots are queried [s]; present robots appear within milliseconds."""
LATE_S = 3.0  # time until they are queried again if none answered [s]; the machine may be busy
INFO_S = 10.0  # longest wait for `info` [s]


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
        self._pending: set[asyncio.Future[zenoh.Reply | None]] = set()
        self._lost_callbacks: list[Callable[[NotConnectedError], None]] = []
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

    async def request(self, data: bytes, timeout_s: float) -> bytes:
        """Send a command as a query and wait for the reply."""
        losses = self._losses
        try:
            return await self._get(keys.key(self._robot, "command"), data, timeout_s)
        except NotConnectedError:
            # If the robot was always present and answers now, access control must have dropped the command.
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
        self._check_open()
        self._setpoints.put(data)

    async def info(self) -> bytes:
        return await self._get(keys.key(self._robot, "info"), None, INFO_S)

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        self._check_open()
        key, droppable = keys.key(self._robot, topic), topic in {"state", "truth"}

        def on_sample(sample: zenoh.Sample) -> None:
            # Other clients may put on a key with a wildcard, which arrives here too.
            if str(sample.key_expr) == key:
                self._mailbox.put(callback, sample.payload.to_bytes(), droppable=droppable)

        self._session.declare_subscriber(key, Callback(on_sample, indirect=False))

    def on_lost(self, callback: Callable[[NotConnectedError], None]) -> None:
        """Call a function when the robot's liveliness token disappears."""
        self._lost_callbacks.append(callback)

    @contextmanager
    def presence(self, client: str) -> Iterator[None]:
        """Hold a liveliness token of the client. It reaches the robot before any command sent later."""
        self._check_open()
        key = keys.client(self._robot, client, str(self._session.info.zid()))
        token = self._session.liveliness().declare_token(key)
        try:
            yield
        finally:
            if not self._closed:
                token.undeclare()  # type: ignore[no-untyped-call]  # zenoh has no type for it

    async def close(self) -> None:
        """Close the session; pending requests fail."""
        if self._closed:
            return
        self._closed = True
        self._fail_pending(self._gone())
        await asyncio.to_thread(close_session, self._session)

    async def _get(self, key: str, data: bytes | None, timeout_s: float) -> bytes:
        """Query one key and return the first answer."""
        self._check_open()
        try:
            answer = ask(self._session, key, data, timeout_s)
        except zenoh.ZError as error:
            raise self._gone() from error
        self._pending.add(answer)
        answer.add_done_callback(self._pending.discard)
        reply = await answer
        robot = f"robot {self._robot!r} at {self._endpoint}"
        if reply is None:
            raise NotConnectedError(f"{robot} does not answer: check that the server is still running")
        if reply.ok is not None:
            return reply.ok.payload.to_bytes()
        why = reply.err.payload.to_bytes() if reply.err is not None else b""
        if why == b"Timeout":
            raise AnswerTimeoutError(
                f"{robot} did not answer within {timeout_s:g} s: try again, or restart its server"
            )
        raise UnexpectedReplyError(f"the answer is an error instead of a message: {why!r:.80}")

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

    def _check_open(self) -> None:
        if self._closed:
            raise self._gone()

    def _gone(self) -> NotConnectedError:
        if self._closed:
            return NotConnectedError("the connection is closed: open another one")
        return NotConnectedError(
            f"robot {self._robot!r} at {self._endpoint} is gone: this client reconnects when it is back"
        )

    def _fail_pending(self, error: ClientError) -> None:
        for answer in tuple(self._pending):
            if not answer.done():
                answer.set_exception(error)

    async def _find(self) -> None:
        robots = list[str]()
        for seconds in (FIND_S, LATE_S - FIND_S):
            with suppress(TimeoutError):
                async with asyncio.timeout(seconds):
                    await self._alive.wait()
                return
            robots = await _robots(self._session)
            if self._robot in robots:  # the robot appeared late because the machine is slow
                return
            with suppress(NotConnectedError):  # a robot that is starting answers but has no token
                await self.info()
                return
            if robots:
                break
        there = f"the robots there are {', '.join(robots)}" if robots else f"none answered in {LATE_S:g} s"
        where, what = self._endpoint, "name and endpoint"
        if self._namespace:
            where, what = f"{where} in namespace {self._namespace}", "name, namespace and endpoint"
        if self._endpoint.startswith("tls/"):  # access control denies silently, too
            what += ", and that the robot lists the name of this certificate"
        raise NotConnectedError(f"no robot {self._robot!r} at {where}; {there}: check {what}")


async def robots_at(endpoint: str, security: Folder | None = None, namespace: str = "") -> list[str]:
    """Return the names of the robots at an endpoint, sorted."""
    session = await _opened(endpoint, security, namespace)
    try:
        return await _robots(session)
    finally:
        await asyncio.to_thread(close_session, session)


async def only_robot(endpoint: str, wanted: str, security: Folder | None = None, namespace: str = "") -> str:
    """Return `wanted` if there is a robot of that name, else the name of the only robot."""
    robots = await robots_at(endpoint, security, namespace)
    if wanted in robots or not robots:
        return wanted
    if len(robots) > 1:
        raise NotConnectedError(
            f"there are several robots at {endpoint}, {', '.join(robots)}: choose one with --name"
        )
    return robots[0]


async def _opened(endpoint: str, security: Folder | None, namespace: str) -> zenoh.Session:
    """Open a session; if this is cancelled, close the session again, because a server admits few."""
    opening = asyncio.create_task(asyncio.to_thread(open_session, endpoint, security, namespace))
    try:
        return await asyncio.shield(opening)
    except asyncio.CancelledError:
        with suppress(NotConnectedError):
            await asyncio.to_thread(close_session, await opening)
        raise


async def _robots(session: zenoh.Session) -> list[str]:
    """Return the names of the reachable robots, in natural order: ur5e-2 before ur5e-10."""
    tokens, _ = await query_tokens(session, keys.ANY_ALIVE, INFO_S)
    return sorted((place[1] for key in tokens if (place := keys.place(key)) is not None), key=natural)


async def query_tokens(session: zenoh.Session, selector: str, seconds: float) -> tuple[list[str], bool]:
    """Return the liveliness tokens that a key selects, and whether the router has told all of them in time."""
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    replies = list[zenoh.Reply]()
    callback = Callback(replies.append, partial(wake, loop, ended.set), indirect=False)
    session.liveliness().get(selector, callback, timeout=seconds)
    await ended.wait()
    tokens = [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
    return tokens, len(tokens) == len(replies)


def natural(name: str) -> list[int | str]:
    """Return a sort key for names, in which digits count as numbers."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]
